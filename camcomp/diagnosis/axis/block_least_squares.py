"""Least squares on time series, judged block by block: what a term predicts for stretches of time it was not fitted on.

Rows that follow each other are no independent witnesses; on shuffled rows any smooth nonsense seems to help. A block
is left out together with a margin on both sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from camcomp.ground.datatypes import Bools, Floats, Ints

MARGIN_S = 0.2
MOST_BLOCKS = 25
WHOLE_RUNS = 4  # from which on runs are left out as wholes
LEAST_Z = 4.0  # mean gain over its standard error
FEWEST = 3  # blocks, of which a standard error can be taken


@dataclass(frozen=True, eq=False)
class Series:
    """Rows of one channel over all runs: y (n,), block number (n,), and for every block the rows to fit on (n,) bool.

    weight (n,): how much a row counts, 1 where it is known to its noise; all alike where it is not given.
    """

    y: Floats
    block: Ints
    others: tuple[np.ndarray, ...]
    weight: Floats | None = None

    def weighed(self, values: Floats) -> Floats:
        """Values (n,) or (n, k) by how much their rows count."""
        return values if self.weight is None else np.asarray((values.T * self.weight).T)


def series(times: Sequence[Floats], values: Sequence[Floats], telling: int | None = None) -> Series:
    """Blocks of equal stretches of every run's time; with four runs or more, a block's whole run is withheld with it.

    Stretches are of time, since an axis may stand still in most of a run. telling: number of runs in which the axis
    moves, all by default; only these predict a withheld run.
    """
    y = np.concatenate(list(values))
    run = np.concatenate([np.full(len(t), k) for k, t in enumerate(times)])
    time = np.concatenate(list(times))
    each = max(MOST_BLOCKS // len(times), 2)
    parts = [np.minimum((t - t[0]) / max(t[-1] - t[0], 1e-12) * each, each - 1).astype(int) for t in times]
    block = np.concatenate([p + k * each for k, p in enumerate(parts)])
    whole = (len(times) if telling is None else telling) >= WHOLE_RUNS
    others = []
    for b in np.unique(block):
        mine = block == b
        same = run == run[mine][0]
        near = (time > time[mine].min() - MARGIN_S) & (time < time[mine].max() + MARGIN_S)
        others.append(~same if whole else ~(same & near))
    return Series(y, np.unique(block, return_inverse=True)[1], tuple(others))


def solve(A: Floats, y: Floats) -> Floats:
    """Least squares (k,) by scaled normal equations."""
    size = np.sqrt(np.mean(A**2, axis=0)) + 1e-300
    B = A / size
    out: Floats = np.linalg.lstsq(B.T @ B, B.T @ y, rcond=1e-13)[0] / size
    return out


def solved(data: Series, A: Floats) -> Floats:
    """Coefficients (k,) of columns A (n, k)."""
    return solve(data.weighed(A), data.weighed(data.y))


def withheld(data: Series, A: Floats) -> Floats:
    """Mean squares (blocks,) of what columns A (n, k) leave of every block when fitted on the others, as rows count."""
    return by_block(data, data.weighed(leftover(data, A)))


def by_block(data: Series, left: Floats) -> Floats:
    """Mean squares (blocks,) of values (n,)."""
    return np.array([np.mean(left[data.block == b] ** 2) for b in range(len(data.others))])


def leftover(data: Series, A: Floats) -> Floats:
    """What columns A (n, k) leave of every row (n,) when fitted on the other blocks.

    No column does more (rms) than all there is: what the other blocks leave open, as they do of two columns that only differ in
    one block, is as little as it may be.
    """
    out = data.y.copy()
    if not A.shape[1]:
        return out
    size = np.sqrt(np.mean(A**2, axis=0)) + 1e-300
    B = A / size
    C, y = data.weighed(B), data.weighed(data.y)
    whole, moment = C.T @ C, C.T @ y
    own = np.linalg.lstsq(whole, moment, rcond=1e-12)[0]
    noise, energy = float(np.sum((y - C @ own) ** 2)), max(float(y @ y), 1e-300)
    whole = whole + noise / energy * np.eye(len(whole))
    for b, rest in enumerate(data.others):
        own = C[~rest]  # the block and its margins
        c = np.linalg.lstsq(whole - own.T @ own, moment - own.T @ y[~rest], rcond=1e-12)[0]
        mine = data.block == b
        out[mine] -= B[mine] @ c
    return out


@dataclass(frozen=True)
class Gain:
    """Gain of a term: mean log ratio of rms on withheld blocks, that mean over its standard error, and number of
    blocks.
    """

    log_ratio: float
    z: float
    blocks: int


def telling(data: Series, A: Floats, at: int, least: float) -> Bools:
    """Blocks (blocks,) in which one of the columns A (n, k) does more (rms) than `least`: an axis that stands there says nothing of
    its speed. All where it does nowhere, or in one block only.
    """
    part = solve(A, data.y)[at] * A[:, at]
    found = np.array([float(np.mean(part[data.block == b] ** 2)) > least**2 for b in range(len(data.others))])
    return found if found.sum() >= FEWEST else np.ones(len(found), bool)


def gain(before: Floats, after: Floats, where: Bools | None = None) -> Gain:
    """From mean squares of the same blocks (blocks,), or of those that say something."""
    if where is not None:
        before, after = before[where], after[where]
    each = 0.5 * (np.log(np.maximum(before, 1e-300)) - np.log(np.maximum(after, 1e-300)))
    spread = float(each.std(ddof=1)) / np.sqrt(len(each)) if len(each) > 1 else 0.0
    return Gain(float(each.mean()), float(each.mean() / spread) if spread > 0 else 0.0, len(each))


def log10_chance(found: Gain, tried: int = 1) -> float:
    """log10 of the chance that a term which is not there gains as much; tried: terms of which this one is the best.

    Student's t of the mean over the blocks, times the terms tried (Bonferroni).
    """
    if found.blocks < 2:
        return 0.0
    with np.errstate(divide="ignore"):
        chance = np.log(stdtr(found.blocks - 1, -found.z))
    return min(float(chance + np.log(tried)) / float(np.log(10.0)), 0.0)


def fit(data: Series, A: Floats) -> tuple[Floats, Floats]:
    """Coefficients (k,) and their covariance (k, k), robust against correlation within a block.

    Source: Liang, Zeger, Biometrika 73 (1986) 13, with the usual correction for the number of blocks.
    """
    c = solved(data, A)
    A, left = data.weighed(A), data.weighed(data.y - A @ c)
    size = np.sqrt(np.mean(A**2, axis=0)) + 1e-150
    B = A / size
    inverse = np.linalg.pinv(B.T @ B, rcond=1e-13)
    meat = np.zeros_like(inverse)
    count = len(data.others)
    for b in range(count):
        mine = data.block == b
        score = B[mine].T @ left[mine]
        meat += np.outer(score, score)
    robust = inverse @ meat @ inverse * (count / max(count - 1, 1))
    return c, robust / np.outer(size, size)
