"""Noise of a recording: sizes that all kinds of log share, outliers, and the noise of a resolution, sd = step / sqrt(12)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from camcomp.ground.datatypes import Floats

REPEATABILITY_MM = 0.001  # of a run, per axis, where nothing is stated (contract, section 5)
HEALTHY = 0.08  # of the noise floor at the tip: what of every effect is within tolerance
MINOR = 0.3  # of the noise floor at the tip: what moves it by less is no cause, whatever its significance (contract, section 6)
AT_FLOOR = (
    1.5  # of the square of the noise floor: what is left on unseen rows is the floor where it is surely below that
)
LEAST_VALUES = 12  # of a deviation or a resolution: that of n values is known to 1 / sqrt(2 n), a fifth
FAR_OFF = 12.0  # robust deviations from its neighbours, or from a model, by which a value is no reading of the machine
IN_A_ROW = 3  # values so far off, one after the other: no mistakes, something lasts
MANY = 0.03  # of the values: more that are so far off are no mistakes
STEADY = 0.1  # of a speed, by which it changes at most over the rows of a fourth difference


def resolution_of(values: Floats) -> float:
    """Step of a recording: all distances between the values (n,) are multiples of it, within a twentieth; 0: none."""
    each = np.unique(values[np.isfinite(values)])
    if len(each) < LEAST_VALUES:
        return 0.0
    steps = np.diff(each)
    steps = steps[steps > 1e-9]  # less is rounding of arithmetic
    times = steps / np.min(steps, initial=np.inf)
    whole = np.round(times)
    return float(steps.sum() / whole.sum()) if len(steps) and np.allclose(times, whole, atol=0.05) else 0.0


def rounding_noise(step: float) -> float:
    """Standard deviation of rounding to a step: step / sqrt(12)."""
    return step / float(np.sqrt(12.0))


def instants_apart(values: Sequence[Floats], speeds: Sequence[Floats], floor: float) -> float:
    """Standard deviation (s) of the time between the two readings of a row, whose difference is a value (n,) of a run.

    While something moves steadily at a speed (n,), values scatter by it times the speed. 0 where the faster half of such rows
    scatters no more than the floor.
    """
    squares, fast = [], []
    for y, v in zip(values, speeds, strict=True):
        if len(y) > 4:
            near, fourth = np.lib.stride_tricks.sliding_window_view(v, 5).T, np.diff(y, 4)
            steady = np.isfinite(fourth) & (np.ptp(near, axis=0) < STEADY * np.abs(near.mean(axis=0)))
            squares.append(fourth[steady] ** 2 / 70.0)
            fast.append(near.mean(axis=0)[steady] ** 2)
    square, speed = (np.concatenate([np.zeros(0), *each]) for each in (squares, fast))
    if len(square) < 2 * LEAST_VALUES:
        return 0.0
    upper = speed >= np.median(speed)
    noise = float(np.median(square[upper]) / chi2.median(1))
    # two deviations of a median of squares, where three windows count as one
    sure = AT_FLOOR + 8.0 / np.sqrt(np.count_nonzero(upper))
    return float(np.sqrt((noise - floor**2) / np.median(speed[upper]))) if noise > sure * floor**2 else 0.0


@dataclass(frozen=True)
class StatedDeviation:
    """Standard deviations of the instruments as the experiment states them, in mm, N, rad and N mm; None where unstated."""

    tip_mm: float | None = None
    encoder_mm: float | None = None
    force_N: float | None = None
    encoder_rad: float | None = None
    force_Nmm: float | None = None
