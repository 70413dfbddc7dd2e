"""The carriage stands off its encoder by a constant, e.g. after a wrong reference run."""

from collections.abc import Mapping

from camcomp.datatypes import Floats
from camcomp.gap.effect import Motion, Parameter

STAGE = "drive"
TARGET = "actuator"
SOURCE = "definition: carriage minus encoder"
PARAMETERS = (
    Parameter("offset_mm", "mm", 0.0, -5.0, 5.0, 0.1, 0.001, "reference runs repeat within 0.02 to 0.5 mm"),
)


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Carriage minus encoder (n, m), mm (rad for a rotary actuator)."""
    offset = p["offset_mm"]
    return error if offset == 0.0 else error + which * offset
