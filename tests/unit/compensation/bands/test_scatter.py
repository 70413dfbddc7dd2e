"""Quantiles, gains and shares of the correction against draws."""

import numpy as np
import pytest

from camcomp.compensation.bands.scatter import LEAST_BETTER, TipMoves, best_share, gained, size_below

Z = np.random.default_rng(5).standard_normal((3, 40_000))


def tip(slope, bend=None):
    slope = np.array(slope, float)[None]
    return TipMoves(slope, np.zeros_like(slope) if bend is None else np.array(bend, float)[None])


LINE = tip([[1.0, 0, 0], [0.2, 0, 0], [0, 0, 0]])
FLAT = tip([[1.0, 0, 0.3], [0, 0.4, 0], [0, 0, 0.5]])
ROUND = tip(np.eye(3))
BENT = tip([[1.0, 0, 0], [0, 0.4, 0], [0, 0, 0.1]], [[0.4, 0, 0], [0, 0.1, 0], [0, 0, 0]])


@pytest.mark.parametrize("moves", [LINE, FLAT, ROUND, BENT], ids=["line", "flat", "round", "bent"])
@pytest.mark.parametrize("mean", [[0, 0, 0], [1.5, 0, 0], [0, 0.6, 0.8]])
@pytest.mark.parametrize("level", [0.5, 0.9, 0.95])
def test_a_size_holds_as_many_draws_as_it_says(moves, mean, level):
    size = np.linalg.norm(np.array(mean)[:, None] + moves.drawn(Z)[0], axis=0)
    bound = size_below(np.array([mean], float) + moves.mean, moves.covariance, level)
    assert (size <= bound[0]).mean() == pytest.approx(level, abs=0.03 if level > 0.5 else 0.09)


def test_without_spread_the_size_is_that_of_the_mean():
    still = tip(np.zeros((3, 1)))
    assert size_below(np.array([[3.0, 4.0, 0.0]]), still.covariance)[0] == pytest.approx(5.0)


@pytest.mark.parametrize("moves", [LINE, FLAT, ROUND, BENT], ids=["line", "flat", "round", "bent"])
@pytest.mark.parametrize("before", [[6.0, 0, 0], [0, 3.0, 0], [2.0, 0.5, 0]])
def test_a_gain_is_what_most_machines_gain(moves, before):
    off = np.array(before)[:, None]
    way = moves.drawn(Z)[0]
    gain = np.linalg.norm(off + way, axis=0) - np.linalg.norm(way, axis=0)
    found = gained(np.array([before], float), np.zeros((1, 3)), moves)[0]
    assert (gain >= found).mean() == pytest.approx(0.95, abs=0.035)


def test_all_of_a_correction_that_is_sure_and_none_of_one_that_is_not():
    before, after = np.array([[1.0, 0, 0]]), np.zeros((1, 3))
    sure, unsure = tip([[0.1], [0], [0]]), tip([[0.6], [0], [0]])
    assert best_share(before, after, sure)[0] == 1.0
    assert best_share(before, after, unsure)[0] == 0.0
    biased = tip([[0.02], [0], [0]], [[-0.1], [0], [0]])  # a twentieth of the error is not to be expected
    assert best_share(before, after, biased)[0] == pytest.approx(0.95)


@pytest.mark.parametrize("size", [0.25, 0.3, 0.35])
def test_a_share_is_as_large_as_is_safe(size):
    before, after = np.array([[1.0, 0, 0]]), np.zeros((1, 3))
    share = best_share(before, after, tip([[size], [0], [0]]))[0]
    assert 0.0 < share < 1.0
    error = 1.0 + size * np.random.default_rng(1).standard_normal(400_000)
    assert (np.abs(error - share) <= np.abs(error)).mean() == pytest.approx(LEAST_BETTER, abs=1e-3)
