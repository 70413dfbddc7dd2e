"""Inertia that the model leaves out: masses that a drive accelerates wind up its spring and show in its force."""

from collections.abc import Mapping

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter
from camcomp.model.statics.description import Robot
from camcomp.model.statics.masses import has_moved_mass

STAGE = "drive"
TARGET = "actuator"
MOMENTARY = True
PLAIN = "inertia of what the drive moves"
REMEDY = "limit acceleration and jerk of the control, or keep the factor in the machine file, so that the program allows for it"
SOURCE = (
    "quasi-static wind-up of a spring by the inertia force of the stated masses, acceleration / (natural frequency)^2 "
    "(Siciliano et al., Robotics, 7.3); holds below about a third of the natural frequency"
)
PARAMETERS = (
    Parameter(
        "factor", "1", 0.0, 0.0, 20.0, 1.0, 0.01, "on the force of the stated masses: 1 where these are right", sign=1
    ),
)


def applies(robot: Robot, target: str | None) -> bool:
    """Whether the machine file states masses that the drive moves."""
    return has_moved_mass(robot, target)


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Carriage minus encoder (n, m), mm, or rad for a hinge: the spring gives way against the acceleration."""
    if p["factor"] == 0.0 or motion.masses is None:
        return error
    return error - p["factor"] * which * motion.masses().drive / motion.stiffness


def on_drive_force(effort: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Force of the drive on its carriage (n, m), N, or N mm for a hinge: more along the acceleration."""
    if p["factor"] == 0.0 or motion.masses is None:
        return effort
    return effort + p["factor"] * which * motion.masses().drive
