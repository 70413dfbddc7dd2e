"""The workpiece is clamped off its stated place: shifted, and turned about the tool axis."""

from collections.abc import Mapping

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Parameter

STAGE = "workpiece"
TARGET = "machine"
PLAIN = "a workpiece clamped off its place"
REMEDY = "probe the workpiece again and correct the work offset (G54)"
SOURCE = "rigid displacement of the workpiece, in the axes of its stated frame"
_SHIFT = "probing and clamping: 0.05 to 0.5 mm"
PARAMETERS = (
    Parameter("shift_x_mm", "mm", 0.0, -50.0, 50.0, 0.15, 0.0003, _SHIFT),
    Parameter("shift_y_mm", "mm", 0.0, -50.0, 50.0, 0.15, 0.0003, _SHIFT),
    Parameter("shift_z_mm", "mm", 0.0, -50.0, 50.0, 0.15, 0.0003, _SHIFT),
    Parameter("rotation_deg", "deg", 0.0, -90.0, 90.0, 0.1, 0.00015, "edge finding: 0.1 to 2 mrad"),
)


def on_workpiece(tip: Floats, p: Mapping[str, float]) -> Floats:
    """Tip (n, 3) as seen from the displaced workpiece, i.e. moved the other way."""
    shift = np.array([p["shift_x_mm"], p["shift_y_mm"], p["shift_z_mm"]])
    angle = np.radians(p["rotation_deg"])
    if angle == 0.0:
        return tip if not shift.any() else tip - shift
    c, s = np.cos(angle), np.sin(angle)
    out: Floats = (tip - shift) @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return out
