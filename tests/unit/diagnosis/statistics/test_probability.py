"""From chances to probabilities."""

from math import log10

import numpy as np
import pytest

from camcomp.diagnosis.axis.noise_floor import log_gain
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


def test_columns_that_are_not_there_gain_as_rarely_as_their_odds_say():
    """The chance of a Bayes factor above K is at most 1/K where the columns do nothing (Markov)."""
    rng = np.random.default_rng(5)
    time = np.linspace(0.0, 1.0, 300)
    beside, waves = np.stack([np.ones(300), time], axis=1), np.stack([np.sin(40.0 * time), np.cos(40.0 * time)], axis=1)
    noise = rng.standard_normal((300, 300))
    noise -= noise @ beside @ np.linalg.pinv(beside)
    assert np.mean([log_gain(each, beside, waves, 1.0) > np.log(20.0) for each in noise]) < 0.05
    assert log_gain(noise[0] + 1.5 * waves[:, 0], beside, waves, 1.0) > np.log(1e6)
