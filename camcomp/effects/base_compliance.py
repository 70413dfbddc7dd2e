"""The base of the machine gives way: it turns and shifts under the weight of what moves and the force at the tool.

With force F and moment M about the machine's origin on the base: turn = (rad_per_Nmm 1 + A) M + rad_per_N (z x F), shift =
mm_per_N F + rad_per_N (M x z). A pedestal that turns about a point h below the origin has rad_per_N = h rad_per_Nmm. A is
what carriages add that turn more easily about one horizontal axis than about the other: difference_rad_per_Nmm about x and
as much less about y, cross_rad_per_Nmm about y by a moment about x and the reverse.
"""

from collections.abc import Mapping

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Load, Motion, Parameter
from camcomp.model.statics.description import Robot
from camcomp.model.statics.masses import has_moved_mass

STAGE = "structure"
TARGET = "machine"
PLAIN = "a base that gives way"
REMEDY = "check anchor bolts, grout and floor; fasten or stiffen the pedestal"
SOURCE = (
    "rigid body on an elastic foundation, small turns: symmetric about the vertical but for its turns about level axes"
)
PARAMETERS = (
    Parameter("rad_per_Nmm", "rad/Nmm", 0.0, 0.0, 1e-6, 2e-10, 2e-12, "pedestals of arms: 1e8 to 1e11 N mm/rad", sign=1),
    Parameter("mm_per_N", "mm/N", 0.0, 0.0, 0.1, 1e-5, 1e-7, "foundations of machines: 1e4 to 1e6 N/mm", sign=1),
    Parameter("rad_per_N", "rad/N", 0.0, -1e-3, 1e-3, 1e-7, 1e-9, "pedestals of 0.2 to 1 m that turn about their foot"),
    Parameter("difference_rad_per_Nmm", "rad/Nmm", 0.0, -1e-6, 1e-6, 2e-10, 2e-12, "wheels and feet further apart one way"),
    Parameter("cross_rad_per_Nmm", "rad/Nmm", 0.0, -1e-6, 1e-6, 2e-10, 2e-12, "the same, askew in the machine frame"),
)  # fmt: skip
_UP = np.array([0.0, 0.0, 1.0])


def applies(robot: Robot, target: str | None) -> bool:
    """Whether the machine file states masses, whose weight loads the base."""
    return target is None and has_moved_mass(robot)


def on_pose(tip: Floats, load: Load, motion: Motion, p: Mapping[str, float]) -> Floats:
    """Tips (n, 3) in the machine frame, moved with the base. What pulls at the platform counts as if it pulled at the tip."""
    turns, shifts, both = p["rad_per_Nmm"], p["mm_per_N"], p["rad_per_N"]
    difference, cross = p["difference_rad_per_Nmm"], p["cross_rad_per_Nmm"]
    if not any(p.values()):
        return tip
    force = load.force + load.wrench[:, :3]
    moment = np.cross(tip, force) + load.wrench[:, 3:]
    if motion.masses is not None:
        base = motion.masses().base
        force, moment = force + base[:, :3], moment + base[:, 3:]
    compliance = np.array([[turns + difference, cross, 0.0], [cross, turns - difference, 0.0], [0.0, 0.0, turns]])
    turn = moment @ compliance + both * np.cross(_UP, force)
    return np.asarray(tip + shifts * force + both * np.cross(moment, _UP) + np.cross(turn, tip))
