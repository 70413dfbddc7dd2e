"""A joint of an arm stops short on either side: where it stands depends on the way it turned last."""

from collections.abc import Mapping

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter
from camcomp.model.hysteresis import play

STAGE = "drive"
TARGET = "actuator"
PLAIN = "a joint that stops short"
REMEDY = "come to every pose from the same side; look at the gear, its preload and its oil"
ARM_ONLY = True
SOURCE = (
    "play operator (Krasnoselskii, Pokrovskii: Systems with hysteresis, 1989); a standing joint is half the width behind "
    "its last direction of travel"
)
ROTARY = (
    Parameter(
        "width_rad", "rad", 0.0, 0.0, 0.01, 1e-4, 3e-6, "lost motion of robot gears: 0.5 to 3 arc minutes", sign=1
    ),
)
PARAMETERS = ROTARY


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Joint minus encoder (n, m), rad; in the middle before the first move is known."""
    width = p["width_rad"]
    if width == 0.0:
        return error
    if not motion.ordered:
        return error - 0.5 * width * which * motion.direction
    aimed = which > 0
    out = error.copy()
    out[:, aimed] += play(motion.encoder[:, aimed], width)
    return out
