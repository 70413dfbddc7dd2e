"""Which groups of effects predict measurements that were withheld: evidence in closed form, block by block.

Rows are r = X a + N b + s + e: effects X with amplitudes a, nuisances N with free b, a discrepancy s that no effect
states, and noise e. The discrepancy is a Gaussian process over postures, so that neighbouring poses, which share it,
do not count as independent witnesses. Blocks are campaigns, or regions of postures where there is only one campaign:
random rows would let five different effects explain the same gap equally well.

Sources: Kennedy, O'Hagan, J. R. Statist. Soc. B 63 (2001) 425 (discrepancy); leave-one-block-out predictive density,
Vehtari, Ojanen, Statistics Surveys 6 (2012) 142.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from camcomp.ground.datatypes import Floats, Ints

KERNEL_WIDTHS = (0.3, 1.0, 3.0)  # of the amplitudes of a group, in units of their scales
CLEAR = 5.0  # log likelihood by which a discrepancy has to be better than noise alone
CHI2_3_MEDIAN, CHI2_3_EDGE = 2.366, 9.348  # of chi-square with 3 degrees of freedom: 50 and 97.5 %
FREE = 1e-6  # precision of nuisances, mm and rad: 1 m


@dataclass(frozen=True)
class Discrepancy:
    """Size mm and length (distance of features) of the process, and noise mm beside it, per coordinate.

    timed: whether the process goes with the order in time instead of the posture.
    """

    size: float
    length: float
    noise: float
    timed: bool = False

    def covariance(self, features: Floats, loose: Floats | None = None) -> Floats:
        """Covariance (n, n) of one coordinate at features (n, f); loose (n,): factors on the noise."""
        square = (features**2).sum(axis=1)
        distance = np.maximum(square[:, None] + square[None, :] - 2.0 * features @ features.T, 0.0)
        K = self.size**2 * np.exp(-0.5 * distance / self.length**2)
        K[np.diag_indices(len(K))] += self.noise**2 * (1.0 if loose is None else loose**2)
        return np.asarray(K, float)

    def whitened(self, D: Floats, b: ResidualBlock) -> tuple[Floats, float]:
        """Columns D (n, 3, q) of a block's rows as (3 n, q), in which it is white and of size one; half the log determinant before."""
        if self.size > 0.0:
            L = cholesky(self.covariance(b.about(self.timed), b.loose), lower=True)
            white = solve_triangular(L, D.reshape(len(D), -1), lower=True).reshape(-1, D.shape[2])
            return np.asarray(white, float), 3.0 * float(np.log(np.diag(L)).sum())
        size = np.full(len(D), self.noise) * (1.0 if b.loose is None else b.loose)
        return (D / size[:, None, None]).reshape(-1, D.shape[2]), 3.0 * float(np.log(size).sum())


def fit_discrepancy(features: Sequence[Floats], rest: Sequence[Floats]) -> Discrepancy:
    """Process that makes the leftovers rest, each (n, 3) mm, most likely; by a grid, refined once."""
    size = float(np.sqrt(np.mean(np.concatenate([r.ravel() for r in rest]) ** 2)))
    best, grid = None, [(s, ln, w) for s in (0.5, 0.8) for ln in (0.15, 0.3, 0.6) for w in (0.35, 0.6, 0.9)]
    rows = sum(r.size for r in rest)
    plain = -0.5 * rows - rows * float(np.log(size))  # nothing but noise
    tried: dict[tuple[float, float, float], float] = {}
    for _ in range(2):
        for s, ln, w in grid:
            key = (round(s, 3), round(ln, 3), round(w, 3))
            if key in tried:
                continue
            at = Discrepancy(size * s, ln, size * w)
            value = 0.0
            for f, r in zip(features, rest, strict=True):
                L = cholesky(at.covariance(f), lower=True)
                white = solve_triangular(L, r, lower=True)
                value += -0.5 * float((white**2).sum()) - 3.0 * float(np.log(np.diag(L)).sum())
            tried[key] = value
            if best is None or value > best[0]:
                best = (value, s, ln, w)
        assert best is not None
        _, s, ln, w = best
        grid = [(s * a, ln * b, w * c) for a in (0.8, 1.0, 1.25) for b in (0.7, 1.0, 1.4) for c in (0.8, 1.0, 1.25)]
    assert best is not None
    if best[0] < plain + CLEAR:  # poses so far apart that a process and noise look the same
        return Discrepancy(0.0, 1.0, size)
    return Discrepancy(size * best[1], best[2], size * best[3])


@dataclass(frozen=True, eq=False)
class ResidualBlock:
    """Rows that are withheld together. features (n, f); X (n, 3, k) in units of scales; N (n, 3, 9); r (n, 3) mm.

    frame: number of the campaign, to which the nuisances belong; alone: whether the block is all of its campaign; loose
    (n,): factors on the noise of rows that lie far out; order (n,): in time, 0 to 1.
    """

    features: Floats
    X: Floats
    N: Floats
    r: Floats
    frame: int
    alone: bool
    loose: Floats | None = None
    order: Floats | None = None

    def about(self, timed: bool) -> Floats:
        """What a discrepancy of the rows goes by: their features (n, f), or the order in time (n, 1), 0 to 1."""
        return self.order[:, None] if timed and self.order is not None else self.features

    def loosened(self, left: Floats) -> ResidualBlock:
        """With the noise that leftovers (n, 3) mm suggest, so that no row far out counts for more than one at the edge.

        Weights of Huber, Ann. Math. Stat. 35 (1964) 73; the scale is that of the median.
        """
        square = (left**2).sum(axis=1)
        scale = max(float(np.median(square)) / CHI2_3_MEDIAN, 1e-18)
        return replace(self, loose=np.maximum(np.sqrt(square / scale / CHI2_3_EDGE), 1.0))


@dataclass(frozen=True)
class Fold:
    """A block that is predicted from others."""

    block: int
    others: tuple[int, ...]


def each_withheld(count: int) -> tuple[Fold, ...]:
    """Every block of `count` predicted from all others."""
    return tuple(Fold(i, tuple(j for j in range(count) if j != i)) for i in range(count))


@dataclass(frozen=True, eq=False)
class Evidence:
    """White Gram matrices of blocks over k effect columns and 9 nuisances per campaign. folds: what is predicted from what."""

    blocks: tuple[ResidualBlock, ...]
    grams: Floats  # (blocks, q, q), q = k + 9 campaigns
    moments: Floats  # (blocks, q)
    effects: int
    folds: tuple[Fold, ...]

    @staticmethod
    def of(
        blocks: Sequence[ResidualBlock], discrepancy: Discrepancy, folds: tuple[Fold, ...] | None = None
    ) -> Evidence:
        """Whitens every block by the discrepancy; without folds, each is withheld once."""
        k = blocks[0].X.shape[2]
        q = k + 9 * (1 + max(b.frame for b in blocks))
        grams, moments = np.zeros((len(blocks), q, q)), np.zeros((len(blocks), q))
        for i, b in enumerate(blocks):
            D = np.concatenate([design(b, k, q), b.r[:, :, None]], axis=2)
            white, _ = discrepancy.whitened(D, b)
            G = white.T @ white
            grams[i], moments[i] = G[:q, :q], G[:q, q]
        return Evidence(tuple(blocks), grams, moments, k, each_withheld(len(blocks)) if folds is None else folds)

    def posterior(self, widths: Floats, blocks: Sequence[int] | None = None) -> Posterior:
        """What some blocks, or all, say at prior widths (k,), 0 = absent."""
        on_blocks = list(range(len(self.blocks)) if blocks is None else blocks)
        A, b = self.grams[on_blocks].sum(axis=0), self.moments[on_blocks].sum(axis=0)
        on = np.concatenate([np.flatnonzero(widths > 0), np.arange(self.effects, len(b))])
        precision = np.concatenate([1.0 / widths[widths > 0] ** 2, np.full(len(b) - self.effects, FREE)])
        M = A[np.ix_(on, on)] + np.diag(precision)
        size = 1.0 / np.sqrt(np.diag(M))
        L = cholesky(size[:, None] * M * size, lower=True)
        y = solve_triangular(L, size * b[on], lower=True)
        value = 0.5 * float(y @ y) - float(np.log(np.diag(L)).sum()) + float(np.log(size).sum())
        value += 0.5 * float(np.log(precision).sum())
        mean = np.zeros(len(b))
        mean[on] = size * solve_triangular(L.T, y, lower=False)
        return Posterior(mean, on, M, value)

    def value(self, widths: Floats) -> float:
        """Log evidence of all blocks together, up to a constant common to all widths."""
        return self.posterior(widths).value

    def fit(self, widths: Floats, blocks: Sequence[int] | None = None) -> tuple[Floats, Floats]:
        """Amplitudes (k,) and covariance (k, k) from some blocks, or all."""
        found = self.posterior(widths, blocks)
        k = self.effects
        return found.mean[:k], found.covariance[:k, :k]

    def predict(self, widths: Floats) -> tuple[float, Floats]:
        """Sum of log predictive densities over the folds, and mean squares (folds,) mm2 there."""
        total, squares = 0.0, np.empty(len(self.folds))
        for i, fold in enumerate(self.folds):
            from_others = self.posterior(widths, fold.others)
            total += self.posterior(widths, (*fold.others, fold.block)).value - from_others.value
            squares[i] = float((self.left(fold, from_others) ** 2).sum(axis=1).mean())
        return total, squares

    def left(self, fold: Fold, from_others: Posterior) -> Floats:
        """What a prediction leaves of a fold's block, (n, 3) mm; its frame is found on it where no other block has it."""
        b, mean = self.blocks[fold.block], from_others.mean
        left = b.r - b.X @ mean[: self.effects]
        if b.alone:
            return without_nuisance(left, b.N)
        at = self.effects + 9 * b.frame
        return np.asarray(left - b.N @ mean[at : at + 9], float)


@dataclass(frozen=True, eq=False)
class Posterior:
    """Mean (q,) and, of the columns that are on, the precision; value: log evidence up to a constant."""

    mean: Floats
    on: Ints
    precision: Floats
    value: float

    @property
    def covariance(self) -> Floats:
        """Covariance (q, q), 0 for what is not on."""
        size = 1.0 / np.sqrt(np.diag(self.precision))
        inverse = size[:, None] * np.linalg.inv(size[:, None] * self.precision * size) * size
        out = np.zeros((len(self.mean), len(self.mean)))
        out[np.ix_(self.on, self.on)] = inverse
        return out


def design(b: ResidualBlock, effects: int, width: int) -> Floats:
    """Columns (n, 3, width) of a block: its effects, and its frame among those of all campaigns."""
    D = np.zeros((len(b.r), 3, width))
    D[:, :, :effects] = b.X
    D[:, :, effects + 9 * b.frame : effects + 9 * b.frame + 9] = b.N
    return D


def without_nuisance(left: Floats, N: Floats) -> Floats:
    """Leftover (n, 3) after the best nuisances of N (n, 3, 9)."""
    A = N.reshape(-1, N.shape[2])
    return left - N @ np.linalg.lstsq(A, left.ravel(), rcond=1e-10)[0]


def regions(features: Floats, count: int) -> np.ndarray:
    """Region number (n,) of every row: the largest region is halved along its longest direction until there are `count`."""
    group = np.zeros(len(features), int)
    for new in range(1, count):
        rows = np.flatnonzero(group == np.argmax(np.bincount(group)))
        if len(rows) < 2:
            break
        centred = features[rows] - features[rows].mean(axis=0)
        along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
        group[rows[along > np.median(along)]] = new
    return group
