"""Logs of single axes as a study takes them: which rows, and when they were taken."""

import numpy as np
import pytest

from camcomp.diagnosis.axis.findings import AxisRun


@pytest.mark.parametrize("clock", ["read late or early", "right about uneven rows"])
def test_positions_say_whether_rows_were_taken_evenly(clock):
    rng = np.random.default_rng(0)
    tick, off = 1e-3 * np.arange(4000), rng.uniform(-3e-5, 3e-5, 4000)
    taken = tick if clock == "read late or early" else tick + off
    way = np.round(40.0 * np.sin(2.3 * taken), 6)
    run = AxisRun(name="r", time=tick + off, setpoint=way, encoder=way, force=np.full(4000, np.nan)).on_ticks()
    assert np.abs(run.time - taken).max() < 1e-6


def test_rows_that_are_taken_out_keep_the_set_points_of_the_whole_log():
    time = 1e-3 * np.arange(200)
    run = (
        AxisRun(name="r", time=time, setpoint=time**2, encoder=time**2, force=np.full(200, np.nan))
        .away_from_gaps()
        .of(time > 0.1)
    )
    assert len(run.time) == len(run.clear) == 99 and len(run.asked[0]) == 200
