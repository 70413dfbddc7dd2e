"""A joint of an arm stops short on either side: where it stands depends on the way it moved last."""

from collections.abc import Mapping

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter
from camcomp.model.hysteresis import play

STAGE = "drive"
TARGET = "actuator"
PLAIN = "a joint that stops short"
REMEDY = "come to every pose from the same side; look at the gear or rack, its preload and its oil"
ARM_ONLY = True
SOURCE = (
    "play operator (Krasnoselskii, Pokrovskii: Systems with hysteresis, 1989); a standing joint is half the width behind "
    "its last direction of travel"
)
FITTED = (
    Parameter("width_mm", "mm", 0.0, 0.0, 0.5, 0.02, 0.0001, "racks and belts of linear axes: 10 to 300 um", sign=1),
)
ROTARY = (
    Parameter(
        "width_rad", "rad", 0.0, 0.0, 0.01, 1e-4, 3e-6, "lost motion of robot gears: 0.5 to 3 arc minutes", sign=1
    ),
)
PARAMETERS = FITTED + ROTARY


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Joint minus encoder (n, m), rad, or mm for a slide; in the middle before the first move is known."""
    width = p.get("width_mm", 0.0) + p.get("width_rad", 0.0)
    if width == 0.0:
        return error
    if not motion.ordered:
        return error - 0.5 * width * which * motion.direction
    aimed = which > 0
    out = error.copy()
    out[:, aimed] += play(motion.encoder[:, aimed], width)
    return out
