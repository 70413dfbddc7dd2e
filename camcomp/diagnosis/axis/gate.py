"""Does the residual of a channel of an axis exceed its floor, in size or within intervals of time?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.stats import chi2, norm

from camcomp.diagnosis.model.folds import REGIONS, Excess
from camcomp.diagnosis.result.types import IntervalShare
from camcomp.diagnosis.statistics.noise_model import BLOCK
from camcomp.diagnosis.statistics.places import FALSE
from camcomp.ground.datatypes import Floats

LOCAL = 2.0  # of the floor's square, that a stretch has to show: as much again as the floor
STRETCH_S = 0.5  # in which a leftover is looked for
LEAST_STRETCHES = 8  # of which one can stand out
LEAST_ROWS = 20  # of a stretch
WITHIN = 0.5  # rows: force and motion of one row are not known to be of one instant to better than that
KNOWN = 0.01  # of the constants of a loop, and of friction: no law of them is better than that


@dataclass(frozen=True)
class AxisGate:
    """`above` the floor, `at` it, or `open`; log10 of the chance that the floor alone looks like this; when."""

    word: Literal["above", "at", "open"]
    chance: float
    intervals: tuple[IntervalShare, ...]

    @property
    def above(self) -> bool:
        """Whether the residual exceeds its floor."""
        return self.word == "above"


def judge(left: Sequence[Floats], times: Sequence[Floats], floor: float, names: Sequence[str]) -> AxisGate:
    """Judge residuals (n,) mm or N at times (n,) s of runs with names against a floor."""
    found, chance = intervals(left, times, floor, names)
    floor = max(floor, 1e-12)
    parts = max(REGIONS // len(left), 2)
    size = np.array([energy(part, floor) for run in left for part in np.array_split(run, parts)]) / floor**2
    excess = Excess(float(size.mean()), float(size.std(ddof=1)) / np.sqrt(len(size)))
    if excess.above or found:
        return AxisGate("above", min(chance, excess.log10_chance if excess.above else 0.0), found)
    return AxisGate("at" if excess.at_floor else "open", 0.0, ())


def energy(left: Floats, floor: float) -> float:
    """Mean square of rows (n,) that follow each other, without what tails make of it.

    Rows that stand out by themselves, and noise with heavy tails, are the instrument's: within blocks of BLOCK rows no more
    than the floor counts, or what half of the blocks show. What goes on for longer counts whole.
    """
    n = len(left) // BLOCK * BLOCK
    if not n:
        return float(np.mean(left**2)) if len(left) else 0.0
    blocks = left[:n].reshape(-1, BLOCK)
    slow, fast = blocks.mean(axis=1), blocks.var(axis=1)
    usual = float(np.median(fast)) * (BLOCK - 1) / float(chi2.median(BLOCK - 1))
    noise = min(float(fast.mean()), max(usual, floor**2 * (1.0 - 1.0 / BLOCK)))
    # of the means, too, what tails do to them
    beyond = max(float(fast.mean()) - noise, 0.0) / (BLOCK - 1)
    return max(float(np.mean(slow**2)) - beyond, 0.0) + noise


def intervals(
    left: Sequence[Floats], times: Sequence[Floats], floor: float, names: Sequence[str]
) -> tuple[tuple[IntervalShare, ...], float]:
    """Stretches in which the mean square is above the floor, and out of what other stretches show (1 % over all of them).

    With log10 of the chance of the most conspicuous stretch.
    """
    stretches = [
        (k, rows)
        for k, t in enumerate(times)
        for rows in np.array_split(np.arange(len(t)), max(_count(t), 1))
        if len(rows) >= LEAST_ROWS
    ]
    if len(stretches) < LEAST_STRETCHES:
        return (), 0.0
    whole = sum(float((r**2).sum()) for r in left)
    size = np.array([energy(left[k][rows], floor) for k, rows in stretches])
    log = np.log(np.maximum(size, 1e-300))
    middle = float(np.median(log))
    # of those below the middle where it is less: any number may stand out
    spread = 1.4826 * min(float(np.median(np.abs(log - middle))), float(np.median(middle - log[log <= middle])))
    rows_each = np.array([len(rows) for _, rows in stretches])
    pure = chi2.isf(FALSE / len(stretches), rows_each) / rows_each  # what even white noise reaches
    chances = norm.logsf((log - middle) / max(spread, 1e-12)) / np.log(10.0) + np.log10(len(stretches))
    out = (chances < np.log10(FALSE)) & (size > LOCAL * floor**2) & (size > pure * np.exp(middle))
    # products of neighbouring rows: of what goes on their squares, of noise nothing, however large it is
    lasting = np.array([np.mean(left[k][rows][1:] * left[k][rows][:-1]) for k, rows in stretches])
    out &= lasting > 0.5 * (LOCAL - 1.0) * floor**2  # half of what is beyond the floor
    joined: list[IntervalShare] = []
    for i in np.flatnonzero(out).tolist():
        k, rows = stretches[i]
        begin, share = times[k][rows[0]], float(size[i] * len(rows)) / max(whole, 1e-300)
        if i and out[i - 1] and stretches[i - 1][0] == k:  # the stretch before it
            before = joined.pop()
            begin, share = before.t0_s, before.share + share
        joined.append(IntervalShare(run=names[k], t0_s=float(begin), t1_s=float(times[k][rows[-1]]), share=share))
    return tuple(joined), float(chances[out].min(initial=0.0))


def _count(time: Floats) -> int:
    length = float(time[-1] - time[0])
    return int(min(length / STRETCH_S, len(time) / LEAST_ROWS))


def not_known(own: Floats) -> Floats:
    """Uncertainty (n,) N of a force by inertia and friction, row by row: of its size, and of its instant within a row."""
    return np.asarray(np.hypot(KNOWN * own, within_a_row(own)))


def within_a_row(own: Floats) -> Floats:
    """Uncertainty (n,) of values by the instant of a row, which is known to half a row; at a peak of one row, too."""
    steps = np.abs(np.diff(own))
    return np.asarray(WITHIN * np.maximum(np.append(steps, 0.0), np.insert(steps, 0, 0.0)))
