"""Runs with clocks of their own: what the clocks differ by is no error of the machine, in whatever order the runs stand."""

import numpy as np
import pytest

from camcomp.diagnosis.diagnose import diagnose
from camcomp.diagnosis.experiment.open_experiment import open_experiment
from tests.validation.recorded.experiment import Bench, Made, Plan, character, row_times, schedule, write
from tests.validation.recorded.faults import Fault

PLAN = Plan(8, machine="router", channels="no-forces", rows=110, runs=4, stated=True, paths=("circles-blended", "zigzag-blended", "pocket-10um", "ramp-exact"))  # fmt: skip


def answer(folder, late_s, labels, rapids):
    """The diagnosis of a machine without errors whose tips are late by late_s (runs,) s."""
    rng = np.random.default_rng(PLAN.seed)
    ways = character(rng, False)
    runs = schedule(PLAN, rng)
    machine = Bench(PLAN, runs, ways)
    times = [row_times(run, PLAN, rapids, rng) for run in runs]
    states = [machine.see((Fault("time_sync", None, {"offset_s": late}),), times)[k] for k, late in enumerate(late_s)]
    path = write(Made(runs, states, {"runs": [{} for _ in runs]}), PLAN, folder)
    text = path.read_text()
    for k, label in enumerate(labels, 1):
        if label:
            text = text.replace(f"log: log-{k}.csv", f"log: log-{k}.csv, clock: {label}")
    path.write_text(text)
    found = open_experiment(path)
    return diagnose(found.job, found.twin, found.runs, stated_mm=PLAN.sensors.tip_mm).result


def named(result):
    return [(each.effect, each.target) for each in result.causes]


@pytest.mark.parametrize(
    ("late_ms", "labels", "rapids", "causes"),
    [
        pytest.param((-6.0, 4.0, 9.0, -3.0), "abcd", False, [], marks=pytest.mark.campaign),
        pytest.param((12.0, 0.0, 0.0, 0.0), ("other", None, None, None), True, [], marks=pytest.mark.campaign),
        pytest.param((5.0, 5.0, 5.2, 5.2), "aabb", True, [("time_sync", None)], marks=pytest.mark.campaign),
        # all that an unknown function of velocity would do here is what a late clock does
        ((5.0, 5.0, 5.2, 5.2), "aabb", False, [("time_sync", None)]),
    ],
)
def test_clocks_that_differ_are_nobodys_fault_and_what_they_share_is_a_cause(tmp_path, late_ms, labels, rapids, causes):
    result = answer(tmp_path, np.array(late_ms) * 1e-3, labels, rapids)
    assert named(result) == causes
    assert result.verdict == ("identified" if causes else "none")
    assert (result.gap.p95_um < 2.5 * result.floor.um) == (not causes)
    if causes:
        low, high = result.causes[0].parameters["offset_s"].ci95
        assert low < 5.1e-3 < high
