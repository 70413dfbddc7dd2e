"""The initial state of play and friction is unknown, however long an axis waits for its first motion."""

import numpy as np
import pytest

from camcomp.diagnosis.diagnose import diagnose
from camcomp.diagnosis.experiment.open_experiment import open_experiment
from tests.validation.recorded.experiment import Bench, Made, Plan, character, row_times, schedule, write

PLAN = Plan(21, machine="router", channels="full", rows=160, runs=4, stated=True, rapids=False, paths=("circles-blended", "dwell-exact", "rectangle-exact"))  # fmt: skip


@pytest.mark.campaign
def test_friction_and_play_leave_nothing_unknown_where_an_axis_waits(tmp_path):
    rng = np.random.default_rng(PLAN.seed)
    ways = character(rng, False)
    runs = schedule(PLAN, rng)
    machine = Bench(PLAN, runs, ways)
    faults = tuple(machine.sized((), effect, axis, 0.02, 1) for effect, axis in (("friction", "y"), ("backlash", "x")))
    times = [row_times(run, PLAN, False, rng) for run in runs]
    waits = [np.mean(np.maximum.accumulate(np.abs(s.commanded[:, 1] - s.commanded[0, 1])) < 0.1) for s in machine.see(faults, times)]  # fmt: skip
    assert max(waits) > 0.2
    found = open_experiment(write(Made(runs, machine.see(faults, times), {"runs": [{} for _ in runs]}), PLAN, tmp_path))
    result = diagnose(found.job, found.twin, found.runs, stated_mm=PLAN.sensors.tip_mm).result
    assert {(each.effect, each.target) for each in result.causes[:2]} == {("friction", "y"), ("backlash", "x")}
    assert all(each.probability > 0.95 for each in result.causes[:2])
    assert result.verdict != "unknown"


@pytest.mark.campaign  # the longest of this file
def test_play_of_an_axis_that_moves_when_the_log_begins_is_one_of_what_may_have_shifted_it(tmp_path):
    """Every log begins on the way down, the play taken up by rapids that are not in it: all that shows is a constant height."""
    rng = np.random.default_rng(PLAN.seed)
    ways = character(rng, False)
    runs = schedule(PLAN, rng)
    machine = Bench(PLAN, runs, ways)
    faults = machine.sized((), "backlash", "z", 0.03, 1)
    times = [row_times(run, PLAN, False, rng) for run in runs]
    seen = machine.see((faults,), times)
    assert all(abs(s.commanded[1, 2] - s.commanded[0, 2]) > 0.1 for s in seen)
    found = open_experiment(write(Made(runs, seen, {"runs": [{} for _ in runs]}), PLAN, tmp_path))
    result = diagnose(found.job, found.twin, found.runs, stated_mm=PLAN.sensors.tip_mm).result
    sets = [{(each.effect, each.target) for each in some} for some in result.alternatives]
    assert {("backlash", "z")} in sets
    assert result.verdict == "ambiguous"
