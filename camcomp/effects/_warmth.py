"""How warm a drive is: what thermal_growth and screw_growth have in common."""

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter

REFERENCE_C = 20.0
WARM_UP_K = 10.0  # rise that an unlogged warm-up ends at; only its product with the growth shows
WARM_UP = Parameter(
    "warm_up_s", "s", 3600.0, 60.0, 1e5, 2.0, 0.35,
    "feed drives warm up in 10 minutes to 3 hours, with several time constants: one is known to a factor of two", log=True,
    scan=(300.0, 900.0, 1800.0, 3600.0, 7200.0, 14400.0),
)  # fmt: skip


def warmth(motion: Motion, warm_up_s: float) -> Floats:
    """Kelvin above 20 deg C (n,): as logged, or along a first-order warm-up from the start of the common clock."""
    if motion.temperature is not None:
        return motion.temperature - REFERENCE_C
    return WARM_UP_K * -np.expm1(-np.maximum(motion.common, 0.0) / warm_up_s)
