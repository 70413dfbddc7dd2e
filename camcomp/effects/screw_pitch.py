"""The screw's pitch is off by a constant share: the carriage gains on its encoder away from home."""

from collections.abc import Mapping

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter

STAGE = "drive"
TARGET = "actuator"
MOMENTARY = True
PLAIN = "a pitch error of the screw"
REMEDY = "put the pitch into the control's compensation table, or keep it in the machine file"
SOURCE = "definition: carriage minus encoder = ppm 1e-6 (encoder - home); classes of ISO 3408-3"
PARAMETERS = (
    Parameter(
        "error_ppm", "ppm", 0.0, -20000.0, 20000.0, 150.0, 1.0, "ISO 3408-3, classes 5 to 10: 23 to 210 um per 300 mm"
    ),
)


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Carriage minus encoder (n, m), mm."""
    ppm = p["error_ppm"]
    return error if ppm == 0.0 else error + which * (ppm * 1e-6) * (motion.encoder - motion.home)
