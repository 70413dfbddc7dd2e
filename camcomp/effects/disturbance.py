"""Something shifts or pushes a carriage for a while: a cover that jams, a hose that pulls, a drive that trips and recovers."""

from collections.abc import Mapping

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter

STAGE = "drive"
TARGET = "actuator"
MOMENTARY = True
PLAIN = "disturbance of a drive for a while"
REMEDY = "look at what touched the axis at that time: covers, chips, hoses, the drive's own log"
SOURCE = (
    "definition: shift, and force over the spring of the drive, between two instants of the clock common to all runs"
)
RISE_S = 0.005  # no drive jumps
_CLOCK = (-1e9, 1e9, 1.0, 0.0)
_WHEN = "any time on the common clock"
_INSTANTS = (
    Parameter("from_s", "s", 0.0, *_CLOCK, _WHEN, scan=(0.0,), placed=True),
    Parameter("to_s", "s", 0.0, *_CLOCK, _WHEN, scan=(0.0,), placed=True),
)
FITTED = (
    Parameter("shift_mm", "mm", 0.0, -5.0, 5.0, 0.03, 0.0003, "disturbances that are noticed afterwards: 5 to 200 um"),
    Parameter("force_N", "N", 0.0, -5000.0, 5000.0, 100.0, 0.5, "hoses and covers: 10 to 500 N"),
    *_INSTANTS,
)
ROTARY = (
    Parameter("shift_rad", "rad", 0.0, -0.01, 0.01, 3e-5, 3e-7, "the same at the end of an arm of 1 m"),
    Parameter("force_Nmm", "Nmm", 0.0, -5e6, 5e6, 1e5, 500.0, "the same at the end of an arm of 1 m"),
    *_INSTANTS,
)
PARAMETERS = (*FITTED[:2], *ROTARY)


def _added(values: Floats, motion: Motion, p: Mapping[str, float], most: Floats) -> Floats:
    """Values (n, m) with most (m,) where the disturbance is there: straight up from its begin, and down to its end."""
    at = np.flatnonzero((motion.common > p["from_s"]) & (motion.common < p["to_s"]))
    if not len(at):
        return values
    since, left = motion.common[at] - p["from_s"], p["to_s"] - motion.common[at]
    out = values.copy()
    out[at] += np.clip(np.minimum(since, left) / RISE_S, 0.0, 1.0)[:, None] * most
    return out


def _size(p: Mapping[str, float]) -> tuple[float, float]:
    """Shift and force, of a slide or of a hinge."""
    return p.get("shift_mm", 0.0) + p.get("shift_rad", 0.0), p.get("force_N", 0.0) + p.get("force_Nmm", 0.0)


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Carriage minus encoder (n, m), mm, or rad for a hinge: the shift, and the way that the force winds up the drive."""
    shift, force = _size(p)
    if (shift == 0.0 and force == 0.0) or p["to_s"] <= p["from_s"]:
        return error
    return _added(error, motion, p, which * (shift + force / motion.stiffness))


def on_drive_force(effort: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Force of the drive on its carriage (n, m), N: it holds against what pushes."""
    force = _size(p)[1]
    if force == 0.0 or p["to_s"] <= p["from_s"]:
        return effort
    return _added(effort, motion, p, -which * force)
