"""Minutes of cutting: a tool that dwells or waits in its cut is not worn by it (contract: pauses do not count)."""

import numpy as np
import pytest

from camcomp.model.motion.driven_path import _waited
from camcomp.model.motion.run_path import moving


def way(waits_s, feed=30.0):
    """Along x for a second, a wait, and another second; a row every 10 ms."""
    n, step = 100, 0.01 * feed
    x = np.concatenate([step * np.arange(n), np.full(round(waits_s / 0.01), step * n), step * (n + np.arange(n))])
    return 0.01 * np.arange(len(x)), np.column_stack([x, np.zeros((len(x), 2))])


@pytest.mark.parametrize("waits_s", [0.0, 1.5])
def test_seconds_in_which_it_stands_do_not_count(waits_s):
    t, tip = way(waits_s)
    assert (moving(t, tip)[1:] * np.diff(t)).sum() == pytest.approx(2.0, abs=0.12)


@pytest.mark.parametrize("feed", [30.0, 1.0])
def test_nor_do_they_where_their_rows_are_missing(feed):
    t, tip = way(1.5, feed)
    on = np.ones(len(t), bool)
    kept = np.flatnonzero(np.concatenate([[True], np.diff(tip[:, 0]) > 0.0]))
    for rows, waits in ((np.arange(len(t)), 0), (kept, 1), (kept[::2], 1), (np.delete(kept, slice(20, 40)), 1)):
        assert _waited(tip[rows], t[rows], on[rows]).sum() == waits


def test_a_slow_cut_is_one_beside_fast_moves_in_the_air():
    t = 0.01 * np.arange(2000)
    x = np.where(t < 12.0, 100.0 * t, 1200.0 + 4.0 * (t - 12.0))
    assert moving(t, np.column_stack([x, 0.0 * x, 0.0 * x])).all()
    assert not _waited(np.column_stack([x, 0.0 * x, 0.0 * x]), t, t >= 12.0).any()


def test_noise_of_an_encoder_is_no_motion_and_a_slow_feed_is_one():
    t = 0.005 * np.arange(400)
    rest = np.random.default_rng(2).integers(-1, 2, (400, 3)) * 2.5e-4
    assert moving(t, rest).mean() < 0.05
    assert moving(t, np.column_stack([0.2 * t, 0.0 * t, 0.0 * t])).all()
    assert moving(t[:1], rest[:1]).tolist() == [0.0]
