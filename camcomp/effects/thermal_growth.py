"""A warming drive grows: carriage minus encoder is proportional to the temperature above 20 deg C."""

from collections.abc import Mapping

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter

STAGE = "drive"
TARGET = "either"
PLAIN = "growth with temperature"
REMEDY = "warm the machine up before it works, log its temperature, and keep the coefficient in the machine file"
SOURCE = "linear expansion; first-order warm-up where no temperature is logged"
WARMS = True  # compensate asks for the machine's temperature
REFERENCE_C = 20.0
WARM_UP_K = 10.0  # rise that an unlogged warm-up ends at; only its product with the growth shows
PARAMETERS = (
    Parameter("growth_mm_per_K", "mm/K", 0.0, -0.1, 0.1, 0.004, 0.000015, "steel, 11.5e-6 per K, 100 to 500 mm free length"),
    Parameter(
        "warm_up_s", "s", 3600.0, 60.0, 1e5, 1.0, 0.0, "feed drives warm up in 10 minutes to 3 hours",
        scan=(300.0, 900.0, 1800.0, 3600.0, 7200.0, 14400.0),
    ),
)  # fmt: skip


def _warmth(motion: Motion, warm_up_s: float) -> Floats:
    """Kelvin above 20 deg C (n,): as logged, or along a first-order warm-up from the start of the common clock."""
    if motion.temperature is not None:
        return motion.temperature - REFERENCE_C
    return WARM_UP_K * -np.expm1(-np.maximum(motion.common, 0.0) / warm_up_s)


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Carriage minus encoder (n, m), mm."""
    growth = p["growth_mm_per_K"]
    if growth == 0.0:
        return error
    return error + growth * _warmth(motion, p["warm_up_s"])[:, None] * which
