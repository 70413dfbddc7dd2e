"""Interpolated cubes that are kept for later programs."""

import numpy as np
import pytest

from camcomp.compensation.long import field as cubes
from camcomp.compensation.long.field import Field, TileFiles
from tests.unit.compensation.long.test_field import ask, machine

TARGET = np.array([[0.0, 0.0, 0.0], [30.0, 5.0, -3.0]])
FORCE = np.array([[100.0, 0.0, -20.0], [0.0, -80.0, 0.0]])


@pytest.fixture(scope="module")
def router():
    return machine("cartesian")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    return tmp_path


def field(machine, force=FORCE):
    return Field(machine, force, files=TileFiles(machine))


def kept(router):
    known = field(router)
    answers = ask(known, TARGET, FORCE)
    known.keep(sound=True)
    return answers, known


def test_the_next_program_finds_the_cubes_and_gets_the_same_answers(router, folder):
    answers, _ = kept(router)
    later = field(router, 1.05 * FORCE)
    again = ask(later, TARGET, FORCE)
    assert later.solved == 0
    assert all((a == b).all() for a, b in zip(again[0], answers[0], strict=True)) and (again[1] == answers[1]).all()


def test_cubes_of_a_range_of_forces_that_became_wider_are_kept_too(router, folder):
    def run():
        known = field(router, 0.1 * FORCE)
        ask(known, TARGET, 0.1 * FORCE)
        ask(known, TARGET, FORCE)
        known.keep(sound=True)
        return known.solved

    assert run() > 0 == run()


def test_figures_count_the_cubes_of_this_program_only(router, folder):
    _, known = kept(router)
    later = field(router)
    _, _, tile = ask(later, TARGET[:1], FORCE[:1])
    later.mark(tile)
    assert later.used.sum() == 1 < len(later.tiles.half)
    assert known.tiles.solved.sum() == later.tiles.solved.sum() > 0


@pytest.mark.parametrize("change", ["machine", "force", "origin"])
def test_cubes_of_something_else_are_not_used(router, folder, change):
    kept(router)
    other = machine("orthoglide-1deg") if change == "machine" else router
    force, middle = (3.0 if change == "force" else 1.0) * FORCE, np.array([0.0, 0.0, float(change == "origin")])
    assert len(Field(other, force, middle, TileFiles(other)).tiles.half) == 0


def test_a_damaged_file_counts_as_none(router, folder):
    kept(router)
    (file,) = folder.rglob("tiles-*.nbc")
    data = bytearray(file.read_bytes())
    data[-9] ^= 1
    file.write_bytes(data)
    assert len(field(router).tiles.half) == 0


def test_cubes_that_fail_the_exact_sample_are_forgotten(router, folder):
    _, known = kept(router)
    known.keep(sound=False)
    assert len(field(router).tiles.half) == 0


def test_only_the_newest_files_are_left(router, folder, monkeypatch):
    monkeypatch.setattr(cubes, "MOST_FILES", 2)
    for k in range(4):
        known = field(router, 2.0**k * FORCE)
        ask(known, TARGET, FORCE)
        known.keep(sound=True)
    assert len(list(folder.rglob("tiles-*.nbc"))) == 2
