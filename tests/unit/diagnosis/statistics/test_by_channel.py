"""A matrix by channels multiplies and is picked from as the array of the same values; zeros take no memory."""

import numpy as np
import pytest

from camcomp.diagnosis.statistics.by_channel import ByChannel, channel_behind_channel
from camcomp.diagnosis.statistics.noise_model import Noise

N, CHANNELS, K = 7, 3, 6


@pytest.fixture
def values():
    """Rows (n, c, k), two thirds of the channels' columns zero."""
    rng = np.random.default_rng(1)
    return rng.standard_normal((N, CHANNELS, K)) * (rng.random((CHANNELS, K)) < 0.4)


@pytest.fixture
def lean(values):
    return ByChannel.of(values[:, c] for c in range(CHANNELS))


@pytest.fixture
def whole(values):
    return channel_behind_channel(values)


def test_what_is_zero_takes_no_place(lean, values):
    kept = sum(X.size for _, X in lean.parts)
    assert kept == np.count_nonzero(values) < values.size / 2
    assert np.array_equal(lean.dense(), values)


def test_it_multiplies_as_an_array(lean, whole):
    rng = np.random.default_rng(2)
    a, X = rng.standard_normal((K, 2)), rng.standard_normal((len(whole), 4))
    X[N : 2 * N] = 0.0
    alike = ByChannel.of(X.reshape(CHANNELS, N, 4))
    assert (len(lean), lean.width) == whole.shape
    for got, true in (
        (lean @ a, whole @ a),
        (lean @ a[:, 0], whole @ a[:, 0]),
        (lean.T @ X, whole.T @ X),
        (lean.T @ X[:, 0], whole.T @ X[:, 0]),
        (lean.T @ lean, whole.T @ whole),
        (lean.T @ alike, whole.T @ X),
        (alike.T @ lean, X.T @ whole),
    ):
        assert got == pytest.approx(true, abs=1e-12)


def test_rows_and_columns_are_picked_as_from_an_array(lean, whole):
    every = np.arange(K)
    for rows in (slice(None), slice(3, 9), slice(N, 2 * N), np.array([0, 6, 7, 8, 20]), np.zeros(0, int)):
        assert np.array_equal(lean[rows][:, every], whole[rows])
    assert np.array_equal(lean[:, [4, 1]], whole[:, [4, 1]])
    assert np.array_equal(lean[2:9, [5]], whole[2:9, [5]])
    assert lean[:, []].shape == (len(whole), 0)


def test_columns_are_exchanged_and_put_beside(lean, whole):
    rng = np.random.default_rng(3)
    new, every = rng.standard_normal((len(whole), 2)), np.arange(K)
    new[:N, 1] = 0.0
    changed = whole.copy()
    changed[:, [4, 0]] = new
    assert np.array_equal(lean.exchanged([4, 0], new)[:, every], changed)
    assert np.array_equal(lean[:, every], whole), "it stays what it was"
    assert np.array_equal(lean.appended(new)[:, np.arange(K + 2)], np.concatenate([whole, new], axis=1))


def test_it_is_made_white_as_an_array_is(lean, values):
    time, inflate = 0.02 * np.arange(N), np.ones((N, CHANNELS))
    inflate[2, 0], inflate[:, 2] = np.nan, np.nan
    noise = Noise(*(np.full((1, CHANNELS), x) for x in (0.5, 0.4, 0.9)), [inflate], [time])
    assert np.array_equal(noise.by_channel(0, lean)[:, np.arange(K)], noise.rows(0, values))


def test_matrices_are_joined_one_behind_the_other(lean, values):
    more = values[:, :, ::-1]
    both = ByChannel.joined([lean, ByChannel.of(more[:, c] for c in range(CHANNELS)), lean])
    assert np.array_equal(both.dense(), np.concatenate([values, more, values], axis=2))
