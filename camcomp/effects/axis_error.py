"""A carriage errs as it moves along its axis: along and about X, Y, Z, by the letters of ISO 230-1.

E, the direction of the error (X, Y, Z) or the axis it turns about (A, B, C), and the axis that moves: EXX positioning, EYX
straightness, ECX yaw. Coefficients are zero at the program's origin (G54), tables at the places that they name in
machine coordinates. Angles move the tip by their arm (Abbe): the tool, and the carriages that this one bears.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Axes, Parameter
from camcomp.model.error_table.spec import AxisErrorSpec as Params

__all__ = ["Params"]
STAGE = "structure"
GEOMETRY = True
TARGET = "named"
TARGETS = tuple(f"E{direction}{axis}" for axis in "XYZ" for direction in "XYZABC")
SLIDES_ONLY = True
PLAIN = "bent or twisted guideway"
REMEDY = "scrape, shim or level the guideway; compensate removes what stays"
SOURCE = "rigid carriages: error of the axis, and its angle times the arm to the tip; letters of ISO 230-1"
_SHIFTS = tuple(each for each in TARGETS if each[1] in "XYZ")
_SLOPE, _BOW = (
    "guideways and scales over 1 m: 5 to 200 um",
    "guideways of 1 m that sag or are clamped bent: 5 to 200 um",
)
_TURN = "carriages over 1 m: 0.005 to 0.3 mrad"
PARAMETERS = (
    Parameter("linear_um_per_m", "um/m", 0.0, -20000.0, 20000.0, 100.0, 1.0, _SLOPE),
    Parameter("quadratic_um_per_m2", "um/m2", 0.0, -1e7, 1e7, 8000.0, 50.0, _BOW),
    Parameter("linear_mrad_per_m", "mrad/m", 0.0, -100.0, 100.0, 2.0, 0.01, _TURN),
    Parameter("quadratic_mrad_per_m2", "mrad/m2", 0.0, -10000.0, 10000.0, 20.0, 0.1, _TURN),
)
# which keys make sense where
OF_TARGET = {
    each: ("linear_um_per_m", "quadratic_um_per_m2", "forward_um", "reverse_um")
    if each in _SHIFTS
    else ("linear_mrad_per_m", "quadratic_mrad_per_m2", "forward_mrad", "reverse_mrad")
    for each in TARGETS
}
# A slope along an axis is its squareness or its pitch; of an angle its slope is what shows first.
SOUGHT = {each: PARAMETERS[1:2] if each in _SHIFTS else PARAMETERS[2:3] for each in TARGETS}


def on_guideway(tip: Floats, axes: Axes, target: str, p: Mapping[str, Any]) -> Floats:
    """Tips (n, 3) in the machine frame. Coefficients count from the program's origin, tables from the machine's."""
    axis = "XYZ".index(target[2])
    place, table = 1e-3 * axes.place[:, axis], p.get("table")  # m
    shift = target in _SHIFTS
    slope, bow = ("linear_um_per_m", "quadratic_um_per_m2") if shift else ("linear_mrad_per_m", "quadratic_mrad_per_m2")
    if p.get(slope, 0.0) == 0.0 and p.get(bow, 0.0) == 0.0 and table is None:
        return tip
    error = 1e-3 * (p.get(slope, 0.0) * place + p.get(bow, 0.0) * place**2)
    if table is not None:
        error = error + table.at(axes.position[:, axis], axes.direction[:, axis])
    if shift:
        return np.asarray(tip + error[:, None] * np.eye(3)["XYZ".index(target[1])])
    about = np.eye(3)["ABC".index(target[1])]
    return np.asarray(tip + error[:, None] * np.cross(about, axes.arm[:, axis]))
