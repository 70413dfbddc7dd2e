"""Least squares on time series in blocks: the residual of each block after a fit to the others.

Neighbouring rows are correlated; on shuffled rows any smooth function seems to help. A block is left out together with a
margin on both sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from camcomp.ground.datatypes import Floats, Ints

MARGIN_S = 0.2
MOST_BLOCKS = 25
WHOLE_RUNS = 4  # from which on runs are left out as wholes
LEAST_Z = 4.0  # mean gain over its standard error


@dataclass(frozen=True, eq=False)
class Series:
    """Rows of one channel over all runs: y (n,), block number (n,), and for every block the rows to fit on (n,) bool."""

    y: Floats
    block: Ints
    others: tuple[np.ndarray, ...]


def series(times: Sequence[Floats], values: Sequence[Floats], moving: int | None = None) -> Series:
    """Blocks of equal stretches of every run's time; with four runs or more, a block's whole run is withheld with it.

    moving: number of runs in which the axis moves, all by default; only these predict a withheld run.
    """
    y = np.concatenate(list(values))
    run = np.concatenate([np.full(len(t), k) for k, t in enumerate(times)])
    time = np.concatenate(list(times))
    each = max(MOST_BLOCKS // len(times), 2)
    parts = [np.minimum((t - t[0]) / max(t[-1] - t[0], 1e-12) * each, each - 1).astype(int) for t in times]
    block = np.concatenate([p + k * each for k, p in enumerate(parts)])
    whole = (len(times) if moving is None else moving) >= WHOLE_RUNS
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


def withheld(data: Series, A: Floats) -> Floats:
    """Mean squares (blocks,) of the residuals of every block after a fit of columns A (n, k) to the others."""
    return by_block(data, held_out_residuals(data, A))


def by_block(data: Series, left: Floats) -> Floats:
    """Mean squares (blocks,) of values (n,)."""
    return np.array([np.mean(left[data.block == b] ** 2) for b in range(len(data.others))])


def held_out_residuals(data: Series, A: Floats) -> Floats:
    """Residuals (n,) of every row after a fit of columns A (n, k) to the other blocks.

    The ridge is the noise over the energy of y: amplitudes that the other blocks do not determine stay small.
    """
    out = data.y.copy()
    if not A.shape[1]:
        return out
    size = np.sqrt(np.mean(A**2, axis=0)) + 1e-300
    B = A / size
    y = data.y
    whole, moment = B.T @ B, B.T @ y
    own = np.linalg.lstsq(whole, moment, rcond=1e-12)[0]
    noise, energy = float(np.sum((y - B @ own) ** 2)), max(float(y @ y), 1e-300)
    whole = whole + noise / energy * np.eye(len(whole))
    for b, rest in enumerate(data.others):
        own = B[~rest]  # the block and its margins
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


def gain(before: Floats, after: Floats) -> Gain:
    """Gain of a term from mean squares of the same blocks (blocks,) without and with it."""
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
    c = solve(A, data.y)
    left = data.y - A @ c
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
