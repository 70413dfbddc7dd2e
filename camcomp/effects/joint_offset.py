"""The carriage stands off its encoder by a constant, e.g. after a wrong reference run."""

from collections.abc import Mapping

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter

STAGE = "drive"
GEOMETRY = True
TARGET = "actuator"
MOMENTARY = True
PLAIN = "a wrong zero of the axis"
REMEDY = "run the reference again and correct the home offset in the control"
SOURCE = "definition: carriage minus encoder; offset_mm for slides, offset_rad for hinges"
FITTED = (Parameter("offset_mm", "mm", 0.0, -5.0, 5.0, 0.1, 0.0003, "reference runs repeat within 0.02 to 0.5 mm"),)
ROTARY = (Parameter("offset_rad", "rad", 0.0, -0.1, 0.1, 1e-3, 1e-5, "joints of arms are mastered to 0.1 to 2 mrad"),)
PARAMETERS = FITTED + ROTARY


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Carriage minus encoder (n, m), mm, or rad for a hinge."""
    offset = p.get("offset_mm", 0.0) + p.get("offset_rad", 0.0)
    return error if offset == 0.0 else error + which * offset
