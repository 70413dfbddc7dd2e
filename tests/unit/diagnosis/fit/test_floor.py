"""The noise of an instrument from its rows: white noise as it is, and no swing of the machine that is faster than the rows."""

import numpy as np
import pytest

from camcomp.diagnosis.fit.floor import row_scatter, steady_scatter

NOISE, ROW_S = 0.003, 0.04
TIME = ROW_S * np.arange(400)


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


def test_a_loop_that_rings_where_it_starts_and_stops_is_none_of_it():
    ringing = np.sum([(TIME > t0) * np.exp(-(TIME - t0).clip(0.0) / 0.5) * np.sin(60.0 * TIME) for t0 in (2.0, 8.0)], 0)
    seen = white(2) + 0.06 * ringing
    assert row_scatter(seen, TIME) > 2.0 * NOISE
    assert steady_scatter(seen, TIME) == pytest.approx(NOISE, rel=0.25)
