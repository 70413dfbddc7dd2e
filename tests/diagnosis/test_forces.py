"""The cutting force that a diagnosis assumes for a log, compared with the plant's, and the answers allowed where it is in
doubt."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.search.unexplained import unexplained_of
from tests.validation.recorded.experiment import Plan, make, write


@pytest.mark.campaign
def test_the_force_turns_when_the_drives_do_not_when_they_are_told_to(tmp_path):
    paths = ("circles-exact", "pocket-blended")
    some_10_ms = Plan(5, "single", (("servo_lag", None),), (60.0,), paths=paths, runs=3, rows=300, rapids=False)
    made = make(some_10_ms)
    runs = open_experiment(write(made, some_10_ms, tmp_path)).runs
    checked = 0
    for run, state in zip(runs, made.states, strict=True):
        rows = np.abs(run.run_path.time[:, None] - state.t).argmin(axis=1)
        mine, true = run.run_path.row_force, state.force[rows]
        sure = (np.linalg.norm(run.run_path.driven.doubt, axis=1) < 1.0) & (np.linalg.norm(true[:, :2], axis=1) > 1.0)
        if sure.any():
            turned = np.arctan2(np.cross(mine, true)[sure, 2], np.sum((mine * true)[sure, :2], axis=1))
            assert abs(np.median(turned)) < 1e-3 and np.sqrt(np.mean(turned**2)) < 3e-3
        checked += int(sure.sum())
    assert checked > 300


@pytest.mark.parametrize(("doubtful", "elsewhere", "shows"), [(1.0, 1.0, True), (2.5, 1.0, False), (1.0, 2.5, True)])
def test_rows_in_doubt_may_err_by_it_together(doubtful, elsewhere, shows):
    """Places of 30 rows where the tip is 6 um off, twice the noise, on a run of 600 rows; doubt elsewhere hides none of them."""
    left = np.random.default_rng(3).normal(0.0, 3e-3, (600, 3))
    inflate = np.ones((600, 9))
    inflate[200:280] = inflate[400:480] = elsewhere
    for first in (100, 300, 500):
        left[first : first + 30] += 6e-3
        inflate[first : first + 30] = doubtful
    problem = SimpleNamespace(
        times=[np.arange(600) * 0.05], noise=SimpleNamespace(inflate=[inflate]), floor=SimpleNamespace(slow_mm=1e-4, axis_mm=3e-3),
        channels_of=lambda kind: slice(0, 3),
    )  # fmt: skip
    found = unexplained_of(problem, "tip", [left])
    assert (found.z > 5.0) == shows and (found.excess_um > 3.5) == shows
