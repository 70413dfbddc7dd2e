"""Where along its program a machine was: passes over one place, beam breaks and ways from anywhere mislead nobody."""

from itertools import pairwise

import numpy as np
import pytest

from camcomp.model.config.load import load_config
from camcomp.model.control import open_program
from camcomp.model.motion.alignment import align

RADIUS, FEED_MM = 20.0, 0.7  # per row
LAPS = "G0 X20 Y0 Z5\nG1 Z0 F300\nG3 X20 Y0 I-20 J0 F1500\nG3 X20 Y0 I-20 J0\nG2 X20 Y0 I-20 J0\nG1 Z5\nG0 X0 Y0\nM2\n"
BACK_AND_FORTH = "G0 X-20 Y0 Z5\nG1 Z0 F300\nX20 F1500\nX-20\nX20\nG1 Z5\nM2\n"


def rows(corners, line):
    """Tips every FEED_MM along straight ways between corners, and their line."""
    out, lines = [], []
    for number, (a, b) in enumerate(pairwise(corners)):
        count = max(int(np.linalg.norm(np.subtract(b, a)) / FEED_MM), 1)
        out.append(np.linspace(a, b, count, endpoint=False))
        lines += [line + number] * count
    return np.concatenate(out), np.array(lines)


def lap(line, way):
    angle = np.arange(0.0, 2 * np.pi, FEED_MM / RADIUS) * way
    return np.stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle), 0 * angle], 1), np.full(len(angle), line)


def laps(start):
    parts = [
        rows([start, (20, 0, 5), (20, 0, 0)], 1),
        lap(3, 1),
        lap(4, 1),
        lap(5, -1),
        rows([(20, 0, 0), (20, 0, 5), (0, 0, 5)], 6),
    ]
    return (np.concatenate(each) for each in zip(*parts, strict=True))


def straight(start):
    return rows([start, (-20, 0, 5), (-20, 0, 0), (20, 0, 0), (-20, 0, 0), (20, 0, 0), (20, 0, 5)], 1)


@pytest.mark.parametrize(("text", "machine"), [(LAPS, laps), (BACK_AND_FORTH, straight)])
@pytest.mark.parametrize("bent_mm", [0.0, 0.7])
def test_rows_lie_on_the_pass_that_they_belong_to(tmp_path, text, machine, bent_mm):
    (tmp_path / "p.nc").write_text(text)
    path = open_program(str(tmp_path / "p.nc"), load_config(["config/cartesian.yaml"])).path
    tip, line = machine((3.0, -4.0, 25.0))
    rng = np.random.default_rng(5)
    tip = tip + rng.normal(0.0, 0.003, tip.shape) + [0.0, 0.0, bent_mm]
    broken = rng.choice(np.arange(60, len(tip) - 20), 8, replace=False)
    tip[broken] += rng.uniform(3.0, 30.0, (len(broken), 3))
    found = align(path, tip, np.full(len(tip), np.nan))
    same = path.line[found.motion] == line
    near_a_change = np.zeros(len(line), bool)
    for k in np.flatnonzero(np.diff(line)):
        near_a_change[k - 1 : k + 3] = True
    judged = ~near_a_change & (line > 1)
    judged[broken] = False
    assert judged.sum() > 0.6 * len(line) and same[judged].all()
    assert np.median(found.distance[judged]) == pytest.approx(bent_mm, abs=0.01)
    assert (np.diff(found.motion[judged]) >= 0).all()


def test_a_log_of_the_last_lap_alone_goes_its_way(tmp_path):
    (tmp_path / "p.nc").write_text(LAPS)
    path = open_program(str(tmp_path / "p.nc"), load_config(["config/cartesian.yaml"])).path
    tip, line = laps((0.0, 0.0, 5.0))
    last = line == 5
    found = align(path, tip[last], np.full(last.sum(), np.nan))
    assert set(path.line[found.motion[2:-2]]) == {5}


@pytest.mark.parametrize(("lost_mm", "followed"), [(2.0, False), (5.0, True)])
def test_rows_of_a_tip_that_bends_far_are_followed_where_that_may_be(tmp_path, lost_mm, followed):
    """Two and a half millimetres from the path: beam breaks, or a soft machine in a heavy cut."""
    (tmp_path / "p.nc").write_text(BACK_AND_FORTH)
    path = open_program(str(tmp_path / "p.nc"), load_config(["config/cartesian.yaml"])).path
    tip, line = straight((3.0, -4.0, 25.0))
    cutting = np.flatnonzero((line > 3) & (np.abs(tip[:, 0]) < 15.0))
    found = align(path, tip + [0.0, 2.5, 0.0], np.full(len(tip), np.nan), lost_mm)
    assert (path.line[found.motion[cutting]] == line[cutting]).all() == followed
    assert (np.abs(found.distance[cutting] - 2.5) < 0.01).all() == followed
