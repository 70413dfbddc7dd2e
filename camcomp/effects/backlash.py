"""Play between encoder and carriage: after a reversal the encoder moves by the full width before the carriage does."""

from collections.abc import Mapping

from camcomp.ground.datatypes import Floats
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


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Carriage minus encoder (n, m), mm, or rad for a hinge; the carriage starts in the middle of its play."""
    width = p.get("width_mm", 0.0) + p.get("width_rad", 0.0)
    if width == 0.0 or not motion.ordered:
        return error
    aimed = which > 0
    out = error.copy()
    out[:, aimed] += play(motion.encoder[:, aimed], width)
    return out
