"""A short version of the campaign of laws: one small experiment, written differently and with less in it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from tests.campaign import runner
from tests.trials import laws
from tests.trials.__main__ import main
from tests.trials.experiment import Plan, make, write

PLAN = Plan(
    5, "single", (("backlash", "y"),), (4.0,), runs=2, rows=150, paths=("circles-blended",), rapids=False, stated=False
)  # fmt: skip
QUICK_SAME = ("order of runs", "cyclic labels", "turned frame")


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("laws")
    write(make(PLAN), PLAN, folder)
    return laws.read(folder)


@pytest.fixture(scope="module")
def before(files, tmp_path_factory):
    return runner.ask(laws.write(files, tmp_path_factory.mktemp("before")))


@pytest.mark.parametrize("name", QUICK_SAME)
def test_what_carries_no_information_changes_nothing(files, before, name, tmp_path):
    changed, names = laws.SAME[name](files, np.random.default_rng(1))
    after = runner.ask(laws.write(changed, tmp_path))
    assert laws.differences(before, after, names, turned=name == "turned frame") == []


def test_fewer_rows_name_no_other_cause(files, before, tmp_path):
    after = runner.ask(laws.write(laws.fewer_rows(files, np.random.default_rng(2))[0], tmp_path))
    assert not laws.another_cause(before, after)
    assert not laws.surer(before, after)


@pytest.mark.parametrize("name", [*laws.LESS, *laws.SAME])
def test_every_law_changes_the_files(files, name):
    changed, _ = (laws.LESS | laws.SAME)[name](files, np.random.default_rng(3))
    assert changed.experiment != files.experiment or changed.machine != files.machine or any(
        a.header != b.header or a.rows.tolist() != b.rows.tolist() for a, b in zip(changed.logs, files.logs, strict=False)
    )  # fmt: skip


def test_laws_can_be_broken():
    cause = {"effect": "backlash", "target": "y", "parameters": {"width_mm": {"value": 0.02, "ci95": [0.018, 0.022]}}}
    gap = {"rms_um": 9.0}
    open_ = {"verdict": "ambiguous", "causes": [cause], "alternatives": [], "gap": gap}
    other = {"verdict": "identified", "causes": [{**cause, "target": "x"}], "alternatives": [], "gap": gap}
    assert laws.another_cause(open_, other) and laws.surer(open_, other)
    assert not laws.another_cause(open_, {**other, "causes": [cause]})
    assert len(laws.differences(open_, other, {})) == 2
    assert laws.differences(open_, {**other, "verdict": "ambiguous"}, {"x": "y"}) == []


def test_laws_are_tried_on_experiments_that_are_there(files, tmp_path):
    laws.write(files, tmp_path / "there" / "e-1")
    (tmp_path / "there" / "truth").mkdir()
    (tmp_path / "there" / "truth" / "e-1.json").write_text("{}")
    given = ["laws", "--of", str(tmp_path / "there"), "--out", str(tmp_path / "out"), "--only", "other names"]
    done = CliRunner().invoke(main, given)
    assert done.exit_code == 0, done.output
    (row,) = map(json.loads, (tmp_path / "out" / "laws.jsonl").read_text().splitlines())
    assert (row["name"], row["law"], row["said"]) == ("e-1", "other names", [])
    assert not (tmp_path / "there" / "e-1" / "other names").exists()


def test_a_machine_without_chains_has_no_names_to_change_round(files):
    arm = replace(files, machine={**files.machine, "robot": {"type": "serial"}})
    assert {name for name in laws.SAME if not laws.applies(name, arm)} == {"cyclic labels", "mirrored labels"}
    assert all(laws.applies(name, files) for name in (laws.LESS | laws.SAME))
