"""The noise of an instrument from its rows: white noise as it is, and no swing of the machine that is faster than the rows."""

import numpy as np
import pytest

from camcomp.diagnosis.fit.floor import row_scatter, steady_scatter, swings

NOISE, ROW_S = 0.003, 0.04
TIME = ROW_S * np.arange(400)


STILL = np.zeros(len(TIME))


def white(seed):
    return np.random.default_rng(seed).normal(0.0, NOISE, len(TIME))


@pytest.mark.parametrize("seed", range(5))
def test_white_noise_is_told_from_all_its_rows(seed):
    assert steady_scatter(white(seed), TIME) == row_scatter(white(seed), TIME) == pytest.approx(NOISE, rel=0.15)


def test_a_screw_that_runs_out_on_a_circle_is_none_of_it():
    """Its wave is slow where the circle turns this axis round, and in between faster than rows are."""
    place = 25.0 * np.sin(2.0 * np.pi * TIME / 8.0)
    seen = white(1) + 0.05 * np.sin(2.0 * np.pi * place / 4.0)
    assert row_scatter(seen, TIME) > 4.0 * NOISE
    assert steady_scatter(seen, TIME) < 2.0 * NOISE


def rings():
    """Where a loop starts and stops."""
    return 0.06 * np.sum(
        [(TIME > t0) * np.exp(-(TIME - t0).clip(0.0) / 0.5) * np.sin(60.0 * TIME) for t0 in (2.0, 8.0)], axis=0
    )


def test_a_loop_that_rings_where_it_starts_and_stops_is_none_of_it():
    seen = white(2) + rings()
    assert row_scatter(seen, TIME) > 2.0 * NOISE
    assert steady_scatter(seen, TIME) == pytest.approx(NOISE, rel=0.25)


def test_what_rings_at_times_is_motion():
    square, noise = swings(white(2) + rings(), TIME, STILL, 0.0)
    assert 0.5 < square / np.mean(rings() ** 2) < 2.0
    assert noise < (1.5 * NOISE) ** 2


@pytest.mark.parametrize("seed", range(5))
def test_a_steady_instrument_a_coarse_one_and_single_rows_far_off_swing_nowhere(seed):
    rng = np.random.default_rng(seed)
    tails = NOISE * rng.standard_t(3, len(TIME))
    outliers = white(seed) + 0.5 * (np.arange(len(TIME)) % 41 == seed)
    coarse = 0.01 * np.round((white(seed) + 0.02 * (TIME > 8.0) * TIME) / 0.01) - 0.02 * (TIME > 8.0) * TIME
    for values, rounding in ((white(seed), 0.0), (tails, 0.0), (outliers, 0.0), (coarse, 0.01 / np.sqrt(12.0))):
        assert swings(values, TIME, STILL, rounding)[0] < (0.2 * NOISE) ** 2  # of heavy tails chance leaves a little


def test_rows_in_doubt_may_swing_by_it():
    doubt = 0.02 * (TIME > 12.0)
    shaken = white(4) + doubt * np.random.default_rng(5).normal(size=len(TIME))
    assert swings(shaken, TIME, STILL, 0.0)[0] > 20.0 * swings(shaken, TIME, doubt, 0.0)[0]
