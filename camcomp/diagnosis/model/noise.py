"""Noise of a channel: resolution of its recording, and scatter and memory of neighbouring rows."""

from __future__ import annotations

import numpy as np

from camcomp.ground.datatypes import Floats

DECIMALS = 9  # of the finest step that is looked for
SAME = 1e-6  # of a step: values this close to its multiples are on them
LEAST_ROWS = 12  # with which a resolution or a scatter is told
ROBUST = 1.4826  # median of absolute deviations to standard deviation, normal distribution
MOST_MEMORY = 0.95  # AR(1) coefficient: more is drift and no noise


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


def scatter_of_rows(values: Floats) -> float:
    """Standard deviation of the noise of rows (n,) in time, from second differences; 0 with fewer than LEAST_ROWS."""
    known = values[np.isfinite(values)]
    if len(known) < LEAST_ROWS:
        return 0.0
    second = np.diff(known, 2) / np.sqrt(6.0)
    return ROBUST * float(np.median(np.abs(second)))


def memory_of_rows(residual: Floats) -> float:
    """AR(1) coefficient of residuals (n,) in time, robust against single rows, between 0 and MOST_MEMORY."""
    known = residual[np.isfinite(residual)]
    if len(known) < LEAST_ROWS:
        return 0.0
    edge = 3.0 * ROBUST * float(np.median(np.abs(known)))
    r = np.clip(known, -edge, edge)
    return float(np.clip((r[1:] @ r[:-1]) / max(float(r @ r), 1e-300), 0.0, MOST_MEMORY))
