"""Noise of a recording from its resolution: sd = step / sqrt(12)."""

from __future__ import annotations

import numpy as np

from camcomp.ground.datatypes import Floats

DECIMALS = 9  # of the finest step that is looked for
SAME = 1e-6  # of a step: values this close to its multiples are on them
LEAST_ROWS = 12  # distinct values from which on a resolution is determined


def resolution_of(values: Floats) -> float:
    """Step of a recording: the coarsest 1, 2, or 5 times a power of ten that all values (n,) are multiples of; 0: none."""
    known = np.abs(values[np.isfinite(values)])
    if len(np.unique(known)) < LEAST_ROWS:
        return 0.0
    for power in range(2, -DECIMALS - 1, -1):
        for first in (5.0, 2.0, 1.0):
            step = first * 10.0**power
            off = known / step
            if np.abs(off - np.round(off)).max() < max(SAME, 4e-16 * off.max()):
                return step
    return 0.0


def rounding_noise(step: float) -> float:
    """Standard deviation of rounding to a step: step / sqrt(12)."""
    return step / float(np.sqrt(12.0))
