"""Experiments of the trials: sizes are as asked, nothing tells the truth, logs hold what the contract says."""

import json
from dataclasses import replace

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from tests.validation.recorded.__main__ import MESS, messy
from tests.validation.recorded.experiment import Plan, idling, make, row_times, truth_json, write
from tests.validation.recorded.machines import MACHINES
from tests.validation.recorded.plant import Run
from tests.validation.recorded.sensors import Sensors, beam_breaks, table, tip_noise
from tests.validation.recordings import recording
from tests.validation.scoring import judge, wilson

PLAN = Plan(7, "single", (("backlash", "y"),), (3.0,), runs=2, rows=120)


@pytest.fixture(scope="module")
def made():
    return make(PLAN)


def test_sizes_are_over_the_noise(made):
    (cause,) = made.record["causes"]
    assert cause["ratio"] == pytest.approx(3.0, rel=0.05)
    assert made.record["small_um"] <= 0.5 * made.record["noise_um"]
    assert {each["effect"] for each in made.record["small"]}.isdisjoint({"backlash"})


def test_the_folder_is_read_and_tells_nothing(made, tmp_path):
    path = write(made, PLAN, tmp_path / "e-1")
    assert len(open_experiment(path).runs) == 2
    everything = "".join(each.read_text() for each in (tmp_path / "e-1").iterdir())
    assert "backlash" not in everything and "single" not in everything and "truth" not in everything


def test_noise_has_the_stated_deviation():
    t = np.arange(0, 12, 0.024)
    drawn = np.concatenate([tip_noise(Sensors(), t, np.random.default_rng(k)) for k in range(60)])
    assert drawn.std(0) == pytest.approx(np.full(3, 0.003), rel=0.03)


def test_answers_are_judged(made):
    truth = json.loads(truth_json(made))
    width = truth["causes"][0]["parameters"]["width_mm"]
    cause = {"effect": "backlash", "target": "y", "probability": 0.97}
    cause["parameters"] = {"width_mm": {"value": width, "ci95": [0.9 * width, 1.1 * width]}}
    gap = {"rms_um": 16.0, "noise_floor_um": 5.2}
    right = {"verdict": "identified", "causes": [cause], "alternatives": [], "gap": gap}
    good = judge(right, truth, {"backlash"})
    assert good["first"] and good["all"] and good["held"] == [True] and not good["false_cause"]
    wrong = judge({**right, "causes": [{**cause, "target": "x"}]}, truth, {"backlash"})
    assert wrong["sure_and_wrong"] and not wrong["first_or_class"]
    class_ = [[{"effect": "friction", "target": "y"}], [{"effect": "backlash", "target": "y"}]]
    assert judge({**right, "causes": [], "alternatives": class_}, truth, {"backlash"})["first_or_class"]
    assert judge({**right, "verdict": "unknown"}, truth, set())["foreign"] == ["backlash"]


def test_what_the_library_has_only_the_name_of_is_foreign(made):
    truth = json.loads(truth_json(made))
    truth["causes"][0] |= {"strange": True}
    nothing = {"verdict": "none", "causes": [], "alternatives": [], "gap": {"rms_um": 5.0, "noise_floor_um": 5.2}}
    missed = judge(nothing, truth, {"backlash"})
    assert missed["foreign"] == ["backlash"] and missed["true"] == []


def test_a_lag_is_due_where_set_points_are_logged(made):
    truth = json.loads(truth_json(made))
    truth["causes"][0] |= {"effect": "servo_lag"}
    nothing = {"verdict": "none", "causes": [], "alternatives": [], "gap": {"rms_um": 5.0, "noise_floor_um": 5.2}}
    assert judge(nothing, truth, {"servo_lag"})["due"]
    assert not judge(nothing, {**truth, "channels": "no-setpoints"}, {"servo_lag"})["due"]


def test_wilson_by_the_textbook():
    assert wilson(8, 10) == (pytest.approx(0.4902, abs=1e-4), pytest.approx(0.9433, abs=1e-4))


def test_the_seed_decides(made):
    again = make(replace(PLAN))
    assert all(np.array_equal(a.tip, b.tip) for a, b in zip(made.states, again.states, strict=True))


@pytest.mark.parametrize("mess", list(MESS))
def test_poor_data_are_poor(made, mess):
    """Every option changes the log of the same state, or the rows and states that are logged."""
    plan = messy(PLAN, (mess,))
    assert plan != PLAN
    if plan.sensors != PLAN.sensors:
        state, machine = made.states[0], MACHINES[PLAN.machine]
        logs = [table(state, each.sensors, "full", machine, np.random.default_rng(2)) for each in (PLAN, plan)]
        assert not np.array_equal(logs[0].values, logs[1].values, equal_nan=True)


def test_outliers_come_alone_and_in_bursts():
    off = beam_breaks(200_000, 0.005, np.random.default_rng(1))
    assert off.mean() == pytest.approx(0.005, rel=0.1)
    bursts = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], off.astype(int), [0]]))))[::2]
    assert (bursts == 1).sum() > 300 and (bursts >= 3).sum() > 50


def test_tails_are_heavy_and_as_wide():
    t = np.arange(0, 2000, 0.02)
    drawn = tip_noise(Sensors(tails=True), t, np.random.default_rng(1))
    assert drawn.std() == pytest.approx(0.003, rel=0.1)
    assert (np.abs(drawn) > 0.015).mean() > 5e-4


def test_idle_machines_stand_still():
    record = recording.load("dwell-exact")
    idle = idling(record, np.random.default_rng(1))
    assert len(idle.t) > len(record.t) + 1000
    assert np.abs(np.diff(idle.tip, axis=0)).max() == np.abs(np.diff(record.tip, axis=0)).max()
    assert idle.name != record.name


def test_logs_begin_where_they_are_said_to():
    plan = replace(PLAN, middle=True, hertz=20.0)
    run = Run(recording.load("zigzag-blended"), True, 0.0)
    first = row_times(run, plan, True, np.random.default_rng(1))
    assert np.diff(first) == pytest.approx(0.05)
    assert first[0] > 0.1 * run.last_s
