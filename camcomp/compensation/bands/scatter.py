"""Errors that scatter from machine to machine: how large they are, what a correction gains, which share of it to take.

Every uncertain input is drawn from a normal distribution of its own; z is how many deviations it lies off its value. To second
order, without products of two inputs, the loaded tip then moves by slope z + bend z^2 / 2.
"""

from __future__ import annotations

from functools import cached_property, lru_cache

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.records import Rows, dataclass

LEVEL = 0.95  # of the machines drawn: what a band promises
LEAST_BETTER = 0.995  # of the machines drawn are not worse off by a share of the correction than without it


@dataclass(frozen=True, eq=False)
class TipMoves(Rows):
    """How loaded tips (n) move with k inputs: mm per deviation, and mm per deviation squared, program frame."""

    slope: Floats  # (n, 3, k)
    bend: Floats  # (n, 3, k)

    @cached_property
    def mean(self) -> Floats:
        """Mean move (n, 3) mm."""
        out: Floats = 0.5 * self.bend.sum(axis=2)
        return out

    @cached_property
    def covariance(self) -> Floats:
        """Covariance (n, 3, 3) mm^2."""
        out: Floats = self.slope @ self.slope.transpose(0, 2, 1) + 0.5 * self.bend @ self.bend.transpose(0, 2, 1)
        return out

    @property
    def squares(self) -> Floats:
        """Mean contribution of every input to the sum of squared errors (k,) mm^2."""
        slope, bend = (np.einsum("nik,nik->k", each, each) for each in (self.slope, self.bend))
        return np.asarray(slope + 0.5 * bend)

    def drawn(self, z: Floats) -> Floats:
        """Moves (n, 3, d) of d machines, z (k, d)."""
        out: Floats = self.slope @ z + 0.5 * self.bend @ z**2
        return out


@lru_cache(maxsize=8)
def _quantiles(level: float) -> tuple[Floats, Floats]:
    """Standardised quantiles of chi-square over 1 / sqrt(degrees of freedom), from 0 (normal) to 1."""
    from statistics import NormalDist  # slow import, as that behind it

    from scipy.special import gammaincinv  # a quarter of a second, for configs that state deviations

    root = np.linspace(0.0, 1.0, 401)
    freedom = 1.0 / root[1:] ** 2
    found = (2.0 * gammaincinv(0.5 * freedom, level) - freedom) / np.sqrt(2.0 * freedom)
    return root, np.concatenate(([NormalDist().inv_cdf(level)], found))


def size_below(mean: Floats, covariance: Floats, level: float = LEVEL) -> Floats:
    """Sizes (n,) that normally distributed vectors stay below with probability `level`.

    mean (n, 3), covariance (n, 3, 3). The square of the size is a sum of squares of normal variables: its quantile is that of
    the chi-square distribution with the same first three cumulants (Hall, Buckley, Eagleson), exact for one
    direction and for three equal ones.
    """
    turned = np.einsum("nij,nj->ni", covariance, mean)
    squared = covariance @ covariance
    c1 = np.einsum("ni,ni->n", mean, mean) + np.trace(covariance, axis1=1, axis2=2)
    c2 = np.trace(squared, axis1=1, axis2=2) + 2.0 * np.einsum("ni,ni->n", mean, turned)
    c3 = np.einsum("nij,nji->n", squared, covariance) + 3.0 * np.einsum("ni,ni->n", turned, turned)
    root = np.where(c2 > 0.0, c3, 0.0) / np.where(c2 > 0.0, c2, 1.0) ** 1.5
    square = c1 + np.sqrt(2.0 * c2) * np.interp(root, *_quantiles(level))
    return np.asarray(np.sqrt(np.maximum(square, 0.0)))


def gained(before: Floats, after: Floats, moves: TipMoves, level: float = LEVEL) -> Floats:
    """By how much (n,) mm the error becomes smaller, at least, with probability `level`; negative: it may grow.

    before, after (n, 3) mm: errors of the machine at its stated values. Taken at the least unlikely of the draws that
    are as unfavourable along the correction, with the scatter across it at its mean square.
    """
    off = before - after
    x, across = _unfavourable(before, off, moves, level)
    sizes = np.sqrt((x**2).sum(axis=1) + across) + np.sqrt(((x - off) ** 2).sum(axis=1) + across)
    less = 2.0 * np.einsum("ni,ni->n", x, off) - (off**2).sum(axis=1)
    return np.asarray(less / np.maximum(sizes, 1e-300))


def excess(before: Floats, moves: TipMoves) -> Floats:
    """Band minus gain (n,) mm of a full correction, from errors before (n, 3) mm; positive: correcting may do harm."""
    return size_below(moves.mean, moves.covariance) - gained(before, np.zeros_like(before), moves)


def best_share(before: Floats, after: Floats, moves: TipMoves) -> Floats:
    """Share (n,) from 0 to 1 of a correction that minimises the mean square of the error, as far as it is safe.

    Safe: with a probability of LEAST_BETTER the error is not larger than without any correction. As far as the tip
    moves normally and the correction evenly this then holds for every sum of squares along a program, too.
    """
    off = before - after
    square = np.maximum((off**2).sum(axis=1), 1e-300)
    mean = np.einsum("ni,ni->n", before + moves.mean, off)
    x, _ = _unfavourable(before, off, moves, LEAST_BETTER)
    safe = 2.0 * np.einsum("ni,ni->n", x, off)
    return np.asarray(np.clip(np.minimum(mean, safe) / square, 0.0, 1.0))


def _unfavourable(before: Floats, off: Floats, moves: TipMoves, level: float) -> tuple[Floats, Floats]:
    """Error (n, 3) mm of the original program at the draw that bounds the error along `off` (n, 3) from below.

    Beside it the mean square (n,) mm^2 of the scatter across. The inputs lie off their values in proportion to what they do
    along `off`.
    """
    from statistics import NormalDist

    along = np.einsum("nik,ni->nk", moves.slope, off)
    size = np.sqrt((along**2).sum(axis=1))
    weight = along / np.maximum(size, 1e-300)[:, None]
    z = -NormalDist().inv_cdf(level) * weight
    square = z**2 + 1.0 - weight**2  # the inputs scatter on across their common direction
    x = before + np.einsum("nik,nk->ni", moves.slope, z) + 0.5 * np.einsum("nik,nk->ni", moves.bend, square)
    common = np.einsum("nik,nk->ni", moves.slope, weight)
    across = (moves.slope**2).sum(axis=(1, 2)) - (common**2).sum(axis=1)
    return x, np.maximum(across, 0.0)
