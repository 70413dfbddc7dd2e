"""Coloured noise is made white; a gap starts afresh; a temperature keeps its course."""

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import steadied
from camcomp.diagnosis.statistics.noise_model import Noise, effective_rows


def coloured(rng, n, slow, memory, sigma):
    out = np.empty(n)
    out[0] = rng.standard_normal()
    for i in range(1, n):
        out[i] = memory * out[i - 1] + np.sqrt(1 - memory**2) * rng.standard_normal()
    return sigma * (np.sqrt(slow) * out + np.sqrt(1 - slow) * rng.standard_normal(n))


@pytest.mark.parametrize(("slow", "memory"), [(0.5, 0.9), (0.9, 0.8), (0.5, 0.97)])
def test_rows_are_white_and_of_size_one(slow, memory):
    rng = np.random.default_rng(1)
    runs = [coloured(rng, 2000, slow, memory, 0.003)[:, None] for _ in range(6)]
    time = 0.02 * np.arange(2000)
    noise = Noise(*(np.full((6, 1), x) for x in (0.003, slow, memory)), [np.ones_like(x) for x in runs], [time] * 6)
    white = np.concatenate([noise.rows(r, x[:, :, None])[:, 0] for r, x in enumerate(runs)])
    assert np.std(white) == pytest.approx(1.0, abs=0.05)
    lags = [np.mean(white[k:] * white[:-k]) for k in (1, 2, 5, 10, 20)]
    assert np.abs(lags).max() < 0.06


def test_a_mean_of_slow_noise_is_worth_as_many_rows_as_its_scatter_says():
    rng = np.random.default_rng(4)
    means = [coloured(rng, 2000, 0.5, 0.9, 1.0).mean() for _ in range(300)]
    noise = Noise(*(np.full((1, 1), x) for x in (1.0, 0.5, 0.9)), [], [])
    assert effective_rows(noise, 0, 2000) == pytest.approx(1.0 / np.mean(np.square(means)), rel=0.2)


def test_a_gap_forgets():
    x, time = np.ones((40, 1, 1)), np.arange(40.0)
    time[20:] += 100.0
    noise = Noise(np.ones((1, 1)), np.full((1, 1), 0.9), np.full((1, 1), 0.95), [x[:, 0]], [time])
    rows = noise.rows(0, x)[:, 0]
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
