"""The tool bends: its tip gives way along the lateral force, whatever the machine does."""

from collections.abc import Mapping

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Load, Motion, Parameter

STAGE = "tool"
TARGET = "machine"
PLAIN = "a tool that bends"
REMEDY = "take a shorter or thicker tool, or less depth; compensate removes what stays"
SOURCE = "cantilever, deflection = force L^3 / (3 E I), across the tool axis (machine z)"
PARAMETERS = (
    Parameter(
        "compliance_mm_per_N",
        "mm/N",
        0.0,
        0.0,
        0.05,
        1.5e-4,
        5e-7,
        "end mills of 6 to 20 mm: 2e-5 to 1e-3 mm/N",
        sign=1,
    ),
)


def on_pose(tip: Floats, load: Load, motion: Motion, p: Mapping[str, float]) -> Floats:
    """Tip (n, 3) in the machine frame, moved along the lateral part of the cutting force."""
    compliance = p["compliance_mm_per_N"]
    if compliance == 0.0:
        return tip
    out: Floats = tip + compliance * load.force * np.array([1.0, 1.0, 0.0])
    return out
