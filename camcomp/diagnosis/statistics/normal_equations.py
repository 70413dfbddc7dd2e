"""Normal equations of white rows, and what they say of amplitudes under normal priors, in closed form.

With D all columns that take part, P their prior precision, both whitened by R, and M = D'D + P

    a | y ~ N(M^-1 D'y, M^-1),     log p(y) = -1/2 (y'y - y'D M^-1 D'y) - 1/2 log det(M P^-1) - log det R^1/2

Further amplitudes x ~ N(0, S^2) of columns X have the gram G = X'(I - D M^-1 D')X and the moment m = X'(y - D M^-1 D'y)
with all else integrated out, and are worth 1/2 m'S (I + S G S)^-1 S m - 1/2 log det(I + S G S).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular

from camcomp.ground.datatypes import Floats, Ints

JITTER = 1e-13  # of the scaled precision: columns that repeat one another


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Normal equations of white rows: A = D'D (q, q), b = D'y (q,), c = y'y, number of values, log of the noise sizes."""

    A: Floats
    b: Floats
    c: float
    rows: int
    log_size: float = 0.0

    def with_noise(self, factor: float) -> NormalEquations:
        """With so many times the noise."""
        if factor == 1.0:
            return self
        more, square = self.rows * float(np.log(factor)), factor**2
        return NormalEquations(self.A / square, self.b / square, self.c / square, self.rows, self.log_size + more)


def sum_grams(grams: Sequence[NormalEquations]) -> NormalEquations:
    """Normal equations of several groups together."""
    A, b = grams[0].A.copy(), grams[0].b.copy()
    for g in grams[1:]:  # in place: a stack of many groups would be large
        A += g.A
        b += g.b
    return NormalEquations(A, b, sum(g.c for g in grams), sum(g.rows for g in grams), sum(g.log_size for g in grams))


@dataclass(frozen=True, eq=False, kw_only=True)
class AmplitudePosterior:
    """Columns `live` under their priors: mean (q,), 0 where a column takes no part, and log evidence of the data."""

    data: NormalEquations
    live: Ints
    scale: Floats  # (live,) that make the precision's diagonal 1
    factor: Floats  # (live, live) lower triangle of the scaled precision
    target: Floats  # `half` (live,) of the data themselves
    mean: Floats
    log_evidence: float

    @staticmethod
    def of(data: NormalEquations, precision: Floats) -> AmplitudePosterior:
        """From normal equations and prior precisions (q,), infinite where a column takes no part."""
        live = np.flatnonzero(np.isfinite(precision))
        A, own = data.A[np.ix_(live, live)], precision[live]
        scale = 1.0 / np.sqrt(np.diag(A) + own)
        factor = cholesky(scale[:, None] * (A + np.diag(own)) * scale + JITTER * np.eye(len(live)), lower=True)
        target = solve_triangular(factor, scale * data.b[live], lower=True)
        mean = np.zeros(len(precision))
        mean[live] = scale * solve_triangular(factor, target, lower=True, trans=1)
        log_det = 2.0 * float((np.log(np.diag(factor)) - np.log(scale)).sum()) - float(np.log(own).sum())
        value = -0.5 * (data.c - float(target @ target) + log_det) - data.log_size
        return AmplitudePosterior(
            data=data, live=live, scale=scale, factor=factor, target=target, mean=mean, log_evidence=value
        )

    def across(self, columns: Sequence[int] | Ints) -> Floats:
        """Covariance (q, d) of all columns with some of the live ones."""
        at = np.searchsorted(self.live, columns)
        right, out = np.zeros((len(self.live), len(at))), np.zeros((len(self.mean), len(at)))
        right[at, np.arange(len(at))] = self.scale[at]
        out[self.live] = self.scale[:, None] * cho_solve((self.factor, True), right)
        return out

    def covariance(self, columns: Sequence[int]) -> Floats:
        """Covariance (d, d) of some of the live columns."""
        return np.asarray(self.across(columns)[columns], float)

    def half(self, products: Floats) -> Floats:
        """L^-1 x (live, d) of products x of the live columns with others, L L' the precision: H'H is what they take of these."""
        return np.asarray(solve_triangular(self.factor, self.scale[:, None] * products, lower=True))

    def blocks_without(self, blocks: Sequence[Ints]) -> list[tuple[Floats, Floats]]:
        """Normal equations of several groups of further columns, each alone, with all live ones integrated out."""
        if not blocks:
            return []
        columns = np.concatenate(list(blocks))
        taken = self.half(self.data.A[np.ix_(self.live, columns)])
        moment = self.data.b[columns] - taken.T @ self.target
        out, start = [], 0
        for own in blocks:
            at = slice(start, start := start + len(own))
            out.append((self.data.A[np.ix_(own, own)] - taken[:, at].T @ taken[:, at], moment[at]))
        return out
