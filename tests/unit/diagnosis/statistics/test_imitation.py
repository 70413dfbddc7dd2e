"""A cause beside something unmodelled: how often it is there where it is stated with a probability."""

import numpy as np
from numpy.polynomial import legendre

from camcomp.diagnosis.model.discrepancy import smooth_functions
from camcomp.diagnosis.model.imitation import probability_with_unmodelled, products_across

FLOOR = 1.0


def drawn(rng, present, lag):
    """A following error by a rough function of the speed, drawn anew, and by a lag of a size where it is present."""
    time = np.linspace(0.0, 20.0, 800)
    speed = np.sin(time) + 0.6 * np.sin(2.3 * time + 1.0)
    u = speed / np.abs(speed).max()
    order = np.arange(2, 9)
    strange = legendre.legvander(u, 8)[:, 1:] @ np.concatenate([rng.standard_normal(1), rng.standard_normal(7) / order])
    gap = 5.0 * strange + (lag * u if present else 0.0)
    one = 100.0 * np.ones((len(time), 1))
    A = np.column_stack([u, one[:, 0]])
    fitted = A @ np.linalg.lstsq(A, gap, rcond=None)[0]
    effect = A[:, :1] @ np.linalg.lstsq(A, gap, rcond=None)[0][:1]
    functions = {"velocity": (0.0, products_across(effect, one, smooth_functions(u, -1.0, 1.0), FLOOR))}
    excess, whole = float(np.std(gap - fitted)), float(np.sqrt(np.mean(effect**2)))
    return probability_with_unmodelled(whole, functions, rows=len(u), excess=excess, floor=FLOOR, odds=0.0)


def test_a_lag_that_explains_as_much_as_is_unmodelled_is_not_sure_and_a_large_one_is():
    rng = np.random.default_rng(1)
    assert np.mean([drawn(rng, False, 0.0) > 0.8 for _ in range(100)]) < 0.1
    assert np.mean([drawn(rng, True, 300.0) > 0.95 for _ in range(100)]) > 0.95


def test_a_lag_of_thousands_of_floors_is_sure_beside_what_is_small_against_it():
    rng = np.random.default_rng(3)
    assert np.mean([drawn(rng, True, 10000.0) > 0.95 for _ in range(20)]) == 1.0


def test_stated_probabilities_come_true():
    """Half of the draws hold a lag, of the sizes that slabs have."""
    rng = np.random.default_rng(2)
    present = rng.random(400) < 0.5
    lag = rng.standard_normal(400) * rng.choice([2.0, 6.0, 20.0, 60.0, 200.0], 400) * FLOOR
    p = np.array([drawn(rng, there, size) for there, size in zip(present, lag, strict=True)])
    assert np.mean(present[p > 0.8]) > 0.8
    assert np.mean(present[p < 0.3]) < 0.4


def test_without_anything_unmodelled_a_cause_is_sure_and_without_an_effect_the_prior_stays():
    assert probability_with_unmodelled(1.0, {}, rows=50, excess=0.0, floor=1.0, odds=0.0) == 1.0
    assert probability_with_unmodelled(0.0, {}, rows=50, excess=0.0, floor=1.0, odds=0.0) == 0.5
