"""Functions of covariates on a residual: what they explain, with columns of causes free and others within tolerance."""

import numpy as np
import pytest

from camcomp.diagnosis.search.unknown import energy_taken
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.evidence import Prior, gram, posterior
from camcomp.diagnosis.statistics.normal_equations import sum_grams


def test_a_pattern_given_twice_counts_once():
    def energy(n):
        return energy_taken(np.full((n, n), 50.0), np.full(n, 40.0))

    assert energy(2) == pytest.approx(energy(1), rel=1e-3) and energy(1) == pytest.approx(32.0, rel=0.01)


def test_functions_of_noise_take_nothing():
    assert energy_taken(50.0 * np.eye(3), np.sqrt(50.0) * np.array([0.3, -1.0, 0.6])) == 0.0


@pytest.mark.parametrize("weight", [[[1.0, 1.0], [1.0, 1.0]], [[0.5, 2.0], [1.0, 0.0]]])
def test_normal_equations_of_patterns_are_those_of_the_stacked_rows(weight):
    """Two runs, two kinds of channel; a free column and one with a tolerance."""
    rng = np.random.default_rng(3)
    prior = Prior(np.array([0.1, 0.2]), np.zeros(2), np.full(2, np.inf))
    W, r = [rng.normal(size=(30, 2)) for _ in range(2)], [rng.normal(size=30) for _ in range(2)]
    D = [[rng.normal(size=(20, 2)), rng.normal(size=(10, 1))] for _ in range(2)]
    factor = [np.repeat(w, [20, 10]) for w in weight]
    blocks = [np.block([[a, np.zeros((20, 1))], [np.zeros((10, 2)), b]]) for a, b in D]
    rows = [
        gram(ByChannel.joined([ByChannel.of([w[:20], w[20:]]), ByChannel.of([d[:20], d[20:]])]).scaled(f), f * x)
        for w, d, f, x in zip(W, blocks, factor, r, strict=True)
    ]
    P, h = posterior(sum_grams(rows), prior, [0]).blocks_without([np.arange(2, 5)])[0]

    every = np.concatenate([f[:, None] * w for f, w in zip(factor, W, strict=True)])
    left = np.concatenate([f * x for f, x in zip(factor, r, strict=True)])
    functions = np.concatenate([f[:, None] * d for f, d in zip(factor, blocks, strict=True)])
    taken = np.linalg.solve(every.T @ every + np.diag([0.01, 25.0]), every.T @ np.column_stack([functions, left]))
    apart = np.column_stack([functions, left]) - every @ taken
    assert P == pytest.approx(functions.T @ apart[:, :3], abs=1e-9)
    assert h == pytest.approx(functions.T @ apart[:, 3], abs=1e-9)
