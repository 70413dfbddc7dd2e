"""Noise that no sensor makes: one axis too smooth or too large, a line in the spectrum; and honest coloured noise."""

import numpy as np
import pytest

from camcomp.diagnosis.fit.noise import roughness
from camcomp.diagnosis.statistics.sensor_noise import colour, covariate, line_share


def autoregression(rho, n, rng):
    e = rng.standard_normal((n, 3)) * np.sqrt(1 - rho**2)
    for i in range(1, n):
        e[i] += rho * e[i - 1]
    return e * 0.0015


def of(rest):
    sigma = np.array([r.std(axis=0) for r in rest])
    return colour(sigma, np.array([roughness(r) for r in rest]))


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8, 0.95])
def test_noise_of_one_colour_in_all_axes_is_noise(rho):
    rng = np.random.default_rng(3)
    assert of([autoregression(rho, 2000, rng) for _ in range(4)]).ratio < 0.3


def test_a_vibration_of_one_axis_is_none_and_depends_on_time():
    rng = np.random.default_rng(4)
    t = np.arange(1000) * 0.02
    rest = [autoregression(0.3, 1000, rng) for _ in range(4)]
    for k, r in enumerate(rest):
        r[:, 1] += 0.01 * np.sin(2 * np.pi * 1.5 * t + k)
    found = of(rest)
    assert found.ratio > 1.5 and np.argmax(found.excess) == 1
    assert covariate(rest, [t] * 4, rest, "xyz", ("x", "y", "z"), found.excess) == "time:y"


def test_the_line_of_a_sine_is_found_at_its_frequency():
    t = np.arange(800) * 0.01
    share, frequency = line_share(np.sin(2 * np.pi * 3.0 * t), t)
    assert share > 0.95 and frequency == pytest.approx(3.0, abs=0.13)
