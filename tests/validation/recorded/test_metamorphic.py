"""A short version of the campaign of laws: one small experiment, written differently and with less in it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.validation import runner, scoring
from tests.validation.recorded import metamorphic
from tests.validation.recorded.experiment import Plan, make, write

PLAN = Plan(
    5, "single", (("backlash", "y"),), (4.0,), runs=2, rows=150, paths=("circles-blended",), rapids=False, stated=False
)  # fmt: skip
QUICK_SAME = (
    "order of runs",
    *(pytest.param(each, marks=pytest.mark.campaign) for each in ("cyclic labels", "turned frame")),
)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("laws")
    write(make(PLAN), PLAN, folder)
    return metamorphic.read(folder)


@pytest.fixture(scope="module")
def before(files, tmp_path_factory):
    return runner.ask(metamorphic.write(files, tmp_path_factory.mktemp("before")))


@pytest.mark.campaign  # fewer rows are in the plain run
@pytest.mark.parametrize("name", QUICK_SAME)
def test_what_carries_no_information_changes_nothing(files, before, name, tmp_path):
    changed, names = metamorphic.SAME[name](files, np.random.default_rng(1))
    after = runner.ask(metamorphic.write(changed, tmp_path))
    assert metamorphic.differences(before, after, names, turned=name == "turned frame") == []


def test_fewer_rows_name_no_other_cause(files, before, tmp_path):
    after = runner.ask(metamorphic.write(metamorphic.fewer_rows(files, np.random.default_rng(2))[0], tmp_path))
    assert not metamorphic.another_cause(before, after)
    assert not metamorphic.surer(before, after)


@pytest.mark.parametrize("name", [*metamorphic.LESS, *metamorphic.SAME])
def test_every_law_changes_the_files(files, name):
    changed, _ = (metamorphic.LESS | metamorphic.SAME)[name](files, np.random.default_rng(3))
    assert changed.experiment != files.experiment or changed.machine != files.machine or any(
        a.header != b.header or a.rows.tolist() != b.rows.tolist() for a, b in zip(changed.logs, files.logs, strict=False)
    )  # fmt: skip


def test_laws_can_be_broken():
    cause = {"effect": "backlash", "target": "y", "parameters": {"width_mm": {"value": 0.02, "ci95": [0.018, 0.022]}}}
    gap = {"rms_um": 9.0}
    open_ = {"verdict": "ambiguous", "causes": [cause], "alternatives": [], "gap": gap}
    other = {"verdict": "identified", "causes": [{**cause, "target": "x"}], "alternatives": [], "gap": gap}
    assert metamorphic.another_cause(open_, other) and metamorphic.surer(open_, other)
    assert not metamorphic.another_cause(open_, {**other, "causes": [cause]})
    assert len(metamorphic.differences(open_, other, {})) == 2
    assert metamorphic.differences(open_, {**other, "verdict": "ambiguous"}, {"x": "y"}) == []


@pytest.mark.campaign  # the laws themselves are in the plain run
def test_a_law_is_tried_on_an_experiment_that_is_there_and_leaves_it_as_it_is(files, tmp_path):
    metamorphic.write(files, tmp_path / "e-1")
    (row,) = scoring.laws(tmp_path / "e-1", tmp_path / "out", ["other names"], 1)
    assert (row["name"], row["law"], row["said"]) == ("e-1", "other names", [])
    assert not (tmp_path / "e-1" / "other names").exists()


def test_a_machine_without_chains_has_no_names_to_change_round(files):
    arm = replace(files, machine={**files.machine, "robot": {"type": "serial"}})
    assert {name for name in metamorphic.SAME if not metamorphic.applies(name, arm)} == {
        "cyclic labels",
        "mirrored labels",
    }
    assert all(metamorphic.applies(name, files) for name in (metamorphic.LESS | metamorphic.SAME))
