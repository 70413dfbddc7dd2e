"""The stretch of a travel in which a gap stands out."""

import numpy as np
import pytest

from camcomp.diagnosis.answer.stretch import stretch


def travel(seed=0):
    return np.random.default_rng(seed).uniform(-60.0, 60.0, 3000)


@pytest.mark.parametrize(("low", "high"), [(12.0, 18.0), (-40.0, -5.0), (50.0, 60.0)])
def test_a_plateau_is_found_where_it_is(low, high):
    p = travel()
    gap = 0.01 * ((p > low) & (p < high)) + np.random.default_rng(1).normal(0.0, 0.001, len(p))
    assert stretch(p, gap) == pytest.approx((low, high), abs=3.0)  # a fortieth of the travel


def test_a_round_bump_is_found_at_half_its_height():
    p = travel()
    a, b = stretch(p, 0.02 * np.exp(-0.5 * ((p - 10.0) / 4.0) ** 2))
    assert (a + b) / 2 == pytest.approx(10.0, abs=1.5) and b - a == pytest.approx(2.355 * 4.0, abs=4.0)


@pytest.mark.parametrize(
    "gap",
    [
        lambda p: 1e-4 * p, lambda p: 1e-6 * p**2, lambda p: 0.01 * np.sin(p / 5.0), lambda p: 0.01 * (np.abs(p) > 30.0),
        lambda p: 0.01 * ((np.abs(p) < 4.0) | (np.abs(p - 30.0) < 4.0)),
    ],
)  # fmt: skip
def test_what_is_everywhere_or_in_several_places_has_no_stretch(gap):
    assert stretch(travel(), gap(travel())) is None


def test_too_little_says_nothing():
    assert stretch(np.arange(5.0), np.ones(5)) is None
    assert stretch(np.full(100, 3.0), np.ones(100)) is None
    assert stretch(np.full(100, np.nan), np.ones(100)) is None
