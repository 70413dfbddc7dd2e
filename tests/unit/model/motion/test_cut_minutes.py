"""Minutes of cutting: a tool that dwells or waits in its cut is not worn by it (contract: pauses do not count)."""

import numpy as np
import pytest

from camcomp.model.motion.run_path import moving


def way(waits_s, missing=False):
    """30 mm/s along x for a second, a wait, and another second; rows every 10 ms, none while it stands where they are missing."""
    n = 100
    x = np.concatenate([0.3 * np.arange(n), np.full(round(waits_s / 0.01), 0.3 * n), 0.3 * (n + np.arange(n))])
    t = 0.01 * np.arange(len(x))
    if missing:
        kept = np.flatnonzero(np.concatenate([[True], np.diff(x) > 0.0]))
        grid = np.linspace(0.0, t[-1], 4 * len(t))
        return grid, np.column_stack([np.interp(grid, t[kept], x[kept]), np.zeros((len(grid), 2))])
    return t, np.column_stack([x, np.zeros((len(x), 2))])


@pytest.mark.parametrize("missing", [False, True])
@pytest.mark.parametrize("waits_s", [0.0, 1.5])
def test_seconds_in_which_it_stands_do_not_count(waits_s, missing):
    t, tip = way(waits_s, missing)
    cut_s = float((moving(t, tip)[1:] * np.diff(t)).sum())
    assert cut_s == pytest.approx(2.0, abs=0.12)


def test_noise_of_an_encoder_is_no_motion_and_a_slow_feed_is_one():
    t = 0.005 * np.arange(400)
    rest = np.random.default_rng(2).integers(-1, 2, (400, 3)) * 2.5e-4
    assert moving(t, rest).mean() < 0.05
    assert moving(t, np.column_stack([0.2 * t, 0.0 * t, 0.0 * t])).all()
    assert moving(t[:1], rest[:1]).tolist() == [0.0]
