"""Clocks of logs are not exact, and where the force jumps a millisecond is half a millimetre of the tip."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.commands.diagnose import examine
from tests.campaign import runner
from tests.diagnosis.conftest import plan_of
from tests.plants.experiments import make, write

SOON_S, EARLY_S = 0.008, 0.0002


def stamped_early(made):
    """The experiment with every row that is taken just after a stop stamped as if it were taken just before it."""
    count, states = 0, []
    for run, state in zip(made.runs, made.states, strict=True):
        t = state.t.copy()
        for stop in run.timeline.begin[1:]:
            i = int(np.searchsorted(t, stop))
            if 0 < i < len(t) and t[i] < stop + SOON_S and t[i - 1] < stop - EARLY_S:
                t[i] = stop - EARLY_S
                count += 1
        states.append(replace(state, t=t))
    return replace(made, states=states), count


@pytest.mark.parametrize("cause", [("time_sync", None), ("chain_error", "z"), ("gravity", None)])
def test_rows_on_the_wrong_side_of_a_corner_change_no_answer(tmp_path, cause):
    plan = plan_of(cause, design="six", samples=250, ratio=10.0)
    made, count = stamped_early(make(plan))
    assert count
    result = examine(write(made, plan, tmp_path / "e", runner.CONFIG))[0]
    assert result["verdict"] == "identified"
    assert [(each["effect"], each["target"]) for each in result["causes"]] == [cause]
    assert result["gap"]["max_um"] < 8 * result["gap"]["rms_um"]
