"""One force triple in the path frame, the same at every point that cuts."""

import numpy as np
from pydantic import Field

from camcomp.ground.datatypes import Floats
from camcomp.model.config.base import Spec
from camcomp.model.cutting.cut import Cut

SOURCES = (
    "The groove example of Klimchik, Pashkevich, Chablat, Hovland, Compensation of compliance errors in parallel "
    "manipulators composed of non-perfect kinematic chains, Advances in Robot Kinematics 2012: 215, -10, -25 N."
)

STEADY = True  # the force depends on the cut alone, not on the way to it


class Params(Spec):
    """Force on the tool in the path frame."""

    Fr_N: float = Field(
        description="force on the tool to the right of the feed (outward on a counter-clockwise circle)"
    )
    Ft_N: float = Field(description="force on the tool along the feed; negative holds the tool back")
    Fz_N: float = Field(description="force on the tool along its axis, away from the workpiece; negative pulls it down")


def force(cut: Cut, params: Params) -> Floats:
    """(Fr, Ft, Fz) (n, 3) in N, the same in every row."""
    return np.tile([params.Fr_N, params.Ft_N, params.Fz_N], (len(cut), 1))
