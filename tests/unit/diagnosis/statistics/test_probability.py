"""From chances to probabilities."""

from math import log10

import numpy as np
import pytest

from camcomp.diagnosis.axis.block_least_squares import Gain, gain, log10_chance
from camcomp.diagnosis.statistics.probability import probability_of_chance, stated


@pytest.mark.parametrize(("p", "probability"), [(0.05, 0.711), (0.01, 0.889), (0.001, 0.982)])
def test_as_published(p, probability):
    """Table 1 of Sellke, Bayarri, Berger: conditional error probabilities 0.289, 0.111, 0.0184."""
    assert probability_of_chance(log10(p)) == pytest.approx(probability, abs=5e-4)


def test_the_probability_follows_the_chance_and_the_prior():
    values = [probability_of_chance(x) for x in (0.0, -1.0, -3.0, -10.0, -300.0)]
    assert values == sorted(values) and values[0] == 0.5 and values[-1] <= 1.0
    assert probability_of_chance(-3.0, prior=0.1) < probability_of_chance(-3.0)
    assert probability_of_chance(0.0, prior=0.1) == pytest.approx(0.1)


def test_nothing_is_stated_as_certain():
    assert stated(1.0) == 0.9999 and stated(0.999949) == 0.9999 and stated(0.60416) == 0.6042 and stated(0.0) == 0.0


def test_blocks_that_gain_by_chance_have_the_chance_that_they_say():
    rng = np.random.default_rng(5)
    chances = [10.0 ** log10_chance(gain(*np.exp(rng.standard_normal((2, 12))))) for _ in range(2000)]
    assert np.mean(np.array(chances) < 0.05) == pytest.approx(0.05, abs=0.015)
    assert log10_chance(Gain(0.1, 9.0, 1)) == 0.0 and log10_chance(Gain(0.1, 5.0, 25)) > log10_chance(
        Gain(0.1, 6.0, 25)
    )
    assert log10_chance(Gain(0.1, 5.0, 25), 10) == pytest.approx(log10_chance(Gain(0.1, 5.0, 25)) + 1.0)
