"""Entry and exit angle of a tooth from radial width and diameter.

Immersion angle phi is counted in the sense of rotation from the direction square to the feed, left of it for a
clockwise spindle; the tooth points along the feed at phi = pi/2 (Altintas, Manufacturing Automation, section 2.7).
"""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from camcomp.ground.datatypes import Floats

Milling = Literal["up", "down"]


def immersion(width: ArrayLike, diameter: float, milling: Milling) -> tuple[Floats, Floats]:
    """Entry and exit angles (n,) in rad for radial widths (n,) in mm; NaN stands for a slot.

    Up (conventional) milling starts at phi = 0 with no chip, down (climb) milling ends at phi = pi with no chip.
    Widths outside [0, diameter] are the caller's error: the angle is NaN.
    """
    b = np.where(np.isnan(np.asarray(width, float)), diameter, width)
    with np.errstate(invalid="ignore"):
        arc = np.arccos(1.0 - 2.0 * b / diameter)
    if milling == "up":
        return np.zeros_like(arc), arc
    return np.pi - arc, np.full_like(arc, np.pi)
