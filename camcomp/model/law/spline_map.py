"""A smooth, bounded map over one or two covariates: a tensor product of uniform cubic B-splines.

It never exceeds its largest coefficient, for the splines add up to one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.records import dataclass

DEGREE = 3


@dataclass(frozen=True, eq=False)
class SplineMap:
    """names: one or two covariates; limits: (low, high) of each; coefficients: (a,) or (a, b), at least 4 each."""

    names: tuple[str, ...]
    limits: tuple[tuple[float, float], ...]
    coefficients: Floats

    def __call__(self, rows: Mapping[str, Floats], n: int) -> Floats:
        """Values (n,); constant beyond the limits."""
        basis = [
            splines(rows[name], low, high, count)
            for name, (low, high), count in zip(self.names, self.limits, self.coefficients.shape, strict=True)
        ]
        if len(basis) == 1:
            return np.asarray(basis[0] @ self.coefficients)
        return np.asarray(np.einsum("ni,ij,nj->n", basis[0], self.coefficients, basis[1]))


def splines(values: Floats, low: float, high: float, count: int) -> Floats:
    """Cubic B-splines (n, count) with equal knots from low to high, at values (n,) held within them; rows add up to one."""
    pieces = count - DEGREE
    u = np.clip((values - low) / max(high - low, 1e-12), 0.0, 1.0) * pieces
    first = np.minimum(u.astype(int), pieces - 1)
    x = u - first
    four = np.stack([(1 - x) ** 3, 3 * x**3 - 6 * x**2 + 4, -3 * x**3 + 3 * x**2 + 3 * x + 1, x**3], axis=1) / 6.0
    out = np.zeros((len(values), count))
    for k in range(4):
        out[np.arange(len(values)), first + k] = four[:, k]
    return out


def tensor(basis: Sequence[Floats]) -> Floats:
    """Products (n, a * b) of the splines of all covariates, in the order of the coefficients' memory."""
    out = basis[0]
    for each in basis[1:]:
        out = np.einsum("ni,nj->nij", out, each).reshape(len(out), -1)
    return out
