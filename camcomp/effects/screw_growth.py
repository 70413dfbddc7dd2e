"""A warming screw grows along the length in use: carriage minus encoder is proportional to temperature and way from home.

The screw between the fixed bearing and home grows by the same length wherever the nut is: that part is thermal_growth.
"""

from collections.abc import Mapping

from camcomp.effects._warmth import WARM_UP, warmth
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter

STAGE = "drive"
TARGET = "either"
SLIDES_ONLY = True
MOMENTARY = True
PLAIN = "a screw that grows as it warms up"
REMEDY = (
    "fit a linear scale or cool the screw; or warm the machine up before it works, log its temperature, and keep the "
    "coefficient in the machine file"
)
SOURCE = (
    "linear expansion of the length between fixed bearing and nut, counted from home: carriage minus encoder = ppm/K 1e-6 "
    "(temperature - 20) (encoder - home)"
)
WARMS = True  # compensate asks for the machine's temperature
PARAMETERS = (
    Parameter(
        "expansion_ppm_per_K", "ppm/K", 0.0, -1000.0, 1000.0, 10.0, 0.05, "steel 11.5; the part that no reference run or scale takes out"
    ),
    WARM_UP,
)  # fmt: skip


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Carriage minus encoder (n, m), mm."""
    ppm = p["expansion_ppm_per_K"]
    if ppm == 0.0:
        return error
    return error + which * (ppm * 1e-6) * warmth(motion, p["warm_up_s"])[:, None] * (motion.encoder - motion.home)
