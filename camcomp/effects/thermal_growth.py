"""A warming drive grows: carriage minus encoder is proportional to the temperature above 20 deg C."""

from collections.abc import Mapping

from camcomp.effects._warmth import WARM_UP, warmth
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter

STAGE = "drive"
TARGET = "either"
MOMENTARY = True
PLAIN = "growth with temperature"
REMEDY = "warm the machine up before it works, log its temperature, and keep the coefficient in the machine file"
SOURCE = "linear expansion; first-order warm-up where no temperature is logged"
WARMS = True  # compensate asks for the machine's temperature
FITTED = (
    Parameter("growth_mm_per_K", "mm/K", 0.0, -0.1, 0.1, 0.004, 0.000015, "steel, 11.5e-6 per K, 100 to 500 mm free length"),
    WARM_UP,
)  # fmt: skip
ROTARY = (
    Parameter("growth_rad_per_K", "rad/K", 0.0, -1e-3, 1e-3, 4e-6, 4e-8, "the same across an arm of 1 m"),
    WARM_UP,
)
PARAMETERS = (FITTED[0], *ROTARY)


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Carriage minus encoder (n, m), mm, or rad for a hinge."""
    growth = p.get("growth_mm_per_K", 0.0) + p.get("growth_rad_per_K", 0.0)
    if growth == 0.0:
        return error
    return error + growth * warmth(motion, p["warm_up_s"])[:, None] * which
