"""Coloured noise is recognised and made white; white noise stays as it is; a gap starts afresh."""

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import steadied
from camcomp.diagnosis.statistics.noise_model import Noise, effective_rows, fit_noise


def coloured(rng, n, slow, memory, sigma):
    out = np.empty(n)
    out[0] = rng.standard_normal()
    for i in range(1, n):
        out[i] = memory * out[i - 1] + np.sqrt(1 - memory**2) * rng.standard_normal()
    return sigma * (np.sqrt(slow) * out + np.sqrt(1 - slow) * rng.standard_normal(n))


def fitted(runs):
    time = [np.arange(len(r)) * 0.02 for r in runs]
    return fit_noise(runs, [np.ones_like(r) for r in runs], time, [True] * len(runs)), time


@pytest.mark.parametrize(("slow", "memory"), [(0.5, 0.9), (0.9, 0.8), (0.5, 0.97)])
def test_rows_are_white_and_of_size_one(slow, memory):
    rng = np.random.default_rng(1)
    runs = [coloured(rng, 2000, slow, memory, 0.003)[:, None] for _ in range(6)]
    noise, time = fitted(runs)
    white = np.concatenate([noise.rows(r, x[:, :, None], np.ones_like(x), time[r])[:, 0] for r, x in enumerate(runs)])
    assert np.std(white) == pytest.approx(1.0, abs=0.05)
    lags = [np.mean(white[k:] * white[:-k]) for k in (1, 2, 5, 10, 20)]
    assert np.abs(lags).max() < 0.06
    # what a mean is worth decides whether a constant is a finding
    true = 2000 / (1 + 2 * slow * memory / (1 - memory))
    assert effective_rows(noise, 0, 2000) == pytest.approx(true, rel=0.35)


def test_white_noise_has_no_slow_part():
    rng = np.random.default_rng(2)
    noise, _ = fitted([rng.standard_normal((500, 1)) for _ in range(6)])
    assert noise.slow.max() == 0.0


def test_a_gap_forgets():
    noise = Noise(np.ones((1, 1)), np.full((1, 1), 0.9), np.full((1, 1), 0.95))
    x, time = np.ones((40, 1, 1)), np.arange(40.0)
    time[20:] += 100.0
    rows = noise.rows(0, x, np.ones((40, 1)), time)[:, 0]
    assert np.array_equal(rows[20:], rows[:20])
    assert rows[0] == pytest.approx(1.0)
    assert rows[19] < 0.6


def test_temperatures_lose_their_noise_and_keep_their_course():
    time = np.linspace(0.0, 40.0, 500)
    warm = 22.0 + 1.5 * (1 - np.exp(-time / 200.0))
    noisy = warm + np.random.default_rng(3).normal(0, 0.05, 500)
    assert np.std(steadied(time, noisy) - warm) < 0.012
    assert np.abs(steadied(time, warm) - warm).max() < 2e-3
    assert steadied(time, np.full(500, np.nan)) is None
