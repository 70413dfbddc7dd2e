"""A slide stands off its scale by a measured table over its travel, one per direction: a calibrated screw or rack."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion
from camcomp.model.error_table.spec import ErrorTableSpec as Params
from camcomp.model.hysteresis import play_between

__all__ = ["Params"]
STAGE = "drive"
GEOMETRY = True
TARGET = "actuator"
SLIDES_ONLY = True
PARAMETERS = ()
PLAIN = "calibrated error of the slide"
REMEDY = "put the table into the control, or keep it in the machine file"
SOURCE = "calibration as in ISO 230-2: carriage minus encoder at stated positions, approached from both sides"


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, Any]) -> Floats:
    """Carriage minus encoder (n, m), mm."""
    table = p.get("table")
    if table is None:
        return error
    out = error.copy()
    for j in np.flatnonzero(which):
        x = motion.encoder[:, j]
        there, back = table.at(x, 1.0), table.at(x, -1.0)
        if not motion.ordered or np.array_equal(there, back):
            out[:, j] += 0.5 * (there + back)
            continue
        # from one column to the other as through a play; where the carriage runs ahead, as through one of the other sign
        held = play_between(x, np.minimum(there, back), np.maximum(there, back))
        out[:, j] += np.where(there > back, there + back - held, held)
    return out
