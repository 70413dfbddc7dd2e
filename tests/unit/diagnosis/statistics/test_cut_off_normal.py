"""The mode of a normal distribution that is cut off at a box, against a bounded least squares of scipy."""

import numpy as np
from scipy.optimize import lsq_linear

from camcomp.diagnosis.statistics.evidence import within


def test_the_mode_is_the_bounded_least_squares_solution():
    """Correlated columns, of which some are beyond their reach alone and inside of it with the others held."""
    rng = np.random.default_rng(5)
    for _ in range(60):
        root = rng.normal(size=(6, 6)) @ np.diag([2.0, 1.5, 1.0, 0.8, 0.6, 0.5])
        covariance = root @ root.T + 0.3 * np.eye(6)
        mean, reach = 3.0 * rng.normal(size=6), rng.uniform(0.5, 2.0, 6)
        whitening = np.linalg.cholesky(np.linalg.inv(covariance)).T
        wanted = lsq_linear(whitening, whitening @ mean, bounds=(-reach, reach), tol=1e-14)
        mode, cost = within(mean, lambda held, c=covariance: c[:, held], reach)
        here = 0.5 * float(np.sum((whitening @ (mode - mean)) ** 2))
        assert here <= wanted.cost * (1.0 + 1e-5) + 1e-9
        np.testing.assert_allclose(cost, wanted.cost, rtol=1e-4, atol=1e-7)
