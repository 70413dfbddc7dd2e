"""Play between encoder and carriage: after a reversal the encoder moves by the full width before the carriage does.

Where the load exceeds the friction behind the play it pushes the carriage to one flank, whatever the sense of travel.
"""

from collections.abc import Mapping

import numpy as np

from camcomp.ground.datatypes import Bools, Floats
from camcomp.model.effect import Motion, Parameter
from camcomp.model.hysteresis import play

STAGE = "drive"
TARGET = "actuator"
PLAIN = "play in the drive"
REMEDY = (
    "adjust the preload of nut and thrust bearing, or replace what is worn; until then compensate takes the play "
    "up at every reversal"
)
SOURCE = "play operator (Krasnoselskii, Pokrovskii: Systems with hysteresis, 1989); reversal value B of ISO 230-2"
FITTED = (
    Parameter(
        "width_mm", "mm", 0.0, 0.0, 0.5, 0.02, 0.0001, "worn ball screws: 2 to 50 um (ISO 230-2 reports)", sign=1
    ),
)
ROTARY = (
    Parameter(
        "width_rad", "rad", 0.0, 0.0, 0.01, 1e-4, 3e-6, "lost motion of robot gears: 0.5 to 3 arc minutes", sign=1
    ),
)
PARAMETERS = FITTED + ROTARY
ROUND_OFF = 1e-6  # of the largest load of a drive: what the solver leaves of a load that is zero


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Carriage minus encoder (n, m), mm, or rad for a hinge; the carriage starts in the middle of its play."""
    slide, hinge = p.get("width_mm", 0.0), p.get("width_rad", 0.0)
    width, aimed = slide + hinge, which > 0
    if width == 0.0:
        return error
    pushed = _load_side(motion, aimed, 0.0 if hinge else np.inf)
    out = error.copy()
    if motion.ordered:
        out[:, aimed] += play(motion.encoder[:, aimed], width, pushed)
    else:
        last = 0.0 if motion.came is None else -motion.came[:, aimed]
        out[:, aimed] += 0.5 * width * np.where(pushed != 0.0, pushed, last)
    return out


def _load_side(motion: Motion, aimed: Bools, unstated: float) -> Floats:
    """Flank (n, k) to which the load pushes the k carriages aimed at: 1 or -1, 0 where the friction behind the play holds them.

    unstated: friction, N or N mm, where none is stated. Guides of slides hold the carriage; gears give way to weight.
    """
    friction = np.full(int(aimed.sum()), np.nan) if motion.friction is None else motion.friction[aimed]
    friction = np.where(np.isnan(friction), unstated, friction)
    if motion.held is None or np.isinf(friction).all():
        return np.zeros((len(motion.time), len(friction)))
    load = -motion.held()
    nothing = ROUND_OFF * np.abs(load).max(axis=1, keepdims=True, initial=0.0)
    load = load[:, aimed]
    return np.asarray(np.sign(load) * (np.abs(load) > np.maximum(friction, nothing)), float)
