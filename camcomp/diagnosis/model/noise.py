"""Noise of a recording: sizes that all kinds of log share, outliers, and the noise of a resolution, sd = step / sqrt(12)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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


@dataclass(frozen=True)
class StatedDeviation:
    """Standard deviations of the instruments as the experiment states them, in mm, N, rad and N mm; None where unstated."""

    tip_mm: float | None = None
    encoder_mm: float | None = None
    force_N: float | None = None
    encoder_rad: float | None = None
    force_Nmm: float | None = None
