"""Instants between the rows of a log, for loops that are faster than its rows."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from camcomp.ground.records import replace
from camcomp.model.effect import Motion
from camcomp.model.hysteresis import direction

STEP_S = 1e-3  # of servo controllers
MOST_STEPS = 50  # between two rows; rows further apart do not show a smooth motion


def between_rows(motion: Motion) -> Motion:
    """The motion with instants between its rows, STEP_S apart at most, over which positions go on smoothly.

    Rows that are more than MOST_STEPS apart are taken as they are.
    """
    time, n = motion.time, len(motion.time)
    if not motion.ordered or n < 5:
        return motion
    per = int(np.ceil(float(np.median(np.diff(time))) / STEP_S - 1e-6))
    if per <= 1 or per > MOST_STEPS:
        return motion
    fine = np.interp(np.arange((n - 1) * per + 1) / per, np.arange(n), time)
    position = Akima1DInterpolator(time, motion.encoder)(np.clip(fine, time[0], time[-1]))
    return replace(
        motion, time=fine, common=motion.common[0] + fine - time[0], cut_min=np.zeros(len(fine)), encoder=position,
        speed=np.gradient(position, fine, axis=0), direction=direction(position),
        temperature=None if motion.temperature is None else np.interp(fine, time, motion.temperature),
    )  # fmt: skip
