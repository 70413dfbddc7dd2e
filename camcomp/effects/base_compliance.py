"""The base of the machine gives way: it turns and shifts under the weight of what moves and the force at the tool.

With force F and moment M about the machine's origin on the base: turn = rad_per_Nmm M + rad_per_N (z x F), shift =
mm_per_N F + rad_per_N (M x z). A pedestal that turns about a point h below the origin has rad_per_N = h rad_per_Nmm.
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
SOURCE = "rigid body on an axially symmetric elastic foundation, small turns"
PARAMETERS = (
    Parameter("rad_per_Nmm", "rad/Nmm", 0.0, 0.0, 1e-6, 2e-10, 2e-12, "pedestals of arms: 1e8 to 1e11 N mm/rad", sign=1),
    Parameter("mm_per_N", "mm/N", 0.0, 0.0, 0.1, 1e-5, 1e-7, "foundations of machines: 1e4 to 1e6 N/mm", sign=1),
    Parameter("rad_per_N", "rad/N", 0.0, -1e-3, 1e-3, 1e-7, 1e-9, "pedestals of 0.2 to 1 m that turn about their foot"),
)  # fmt: skip
_UP = np.array([0.0, 0.0, 1.0])


def applies(robot: Robot, target: str | None) -> bool:
    """Whether the machine file states masses, whose weight loads the base."""
    return target is None and has_moved_mass(robot)


def on_pose(tip: Floats, load: Load, motion: Motion, p: Mapping[str, float]) -> Floats:
    """Tips (n, 3) in the machine frame, moved with the base. What pulls at the platform counts as if it pulled at the tip."""
    turns, shifts, both = p["rad_per_Nmm"], p["mm_per_N"], p["rad_per_N"]
    if turns == 0.0 and shifts == 0.0 and both == 0.0:
        return tip
    force = load.force + load.wrench[:, :3]
    moment = np.cross(tip, force) + load.wrench[:, 3:]
    if motion.masses is not None:
        base = motion.masses().base
        force, moment = force + base[:, :3], moment + base[:, 3:]
    turn = turns * moment + both * np.cross(_UP, force)
    return np.asarray(tip + shifts * force + both * np.cross(moment, _UP) + np.cross(turn, tip))
