"""Two axes are not square: the tip moves along the first one by a share of its way along the second."""

from collections.abc import Mapping

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Axes, Parameter

STAGE = "structure"
GEOMETRY = True
TARGET = "named"
TARGETS = ("xy", "xz", "yz")
PLAIN = "two axes that are not square"
REMEDY = "set the guideways square to each other; compensate removes what stays"
SOURCE = "definition: error along the first axis = angle (position along the second); squareness of ISO 230-1, zero at the program's origin"
PARAMETERS = (Parameter("angle_mrad", "mrad", 0.0, -50.0, 50.0, 0.5, 0.002, "gantries squared by hand: 0.1 to 5 mrad"),)


def on_guideway(tip: Floats, axes: Axes, target: str, p: Mapping[str, float]) -> Floats:
    """Tips (n, 3) in the machine frame."""
    angle = p["angle_mrad"]
    if angle == 0.0:
        return tip
    first, second = ("xyz".index(letter) for letter in target)
    out = tip.copy()
    out[:, first] += 1e-3 * angle * axes.place[:, second]
    return out
