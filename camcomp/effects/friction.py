"""Coulomb friction at the guide: the drive has to push harder along its travel, which winds up its spring."""

from collections.abc import Mapping

from camcomp.datatypes import Floats
from camcomp.gap.effect import Motion, Parameter

STAGE = "drive"
TARGET = "actuator"
SOURCE = "force balance of the carriage; turn-round of the force after Dahl 1968"
PARAMETERS = (
    Parameter("force_N", "N", 0.0, 0.0, 2000.0, 60.0, 0.2, "guides and seals of feed drives: 5 to 300 N", sign=1),
)


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Carriage minus encoder (n, m), mm: the spring gives way against the travel."""
    force = p["force_N"]
    if force == 0.0:
        return error
    return error - which * (force / motion.stiffness) * motion.direction


def on_drive_force(effort: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Force of the drive on its carriage (n, m), N: more by the friction, along the travel."""
    force = p["force_N"]
    return effort if force == 0.0 else effort + which * force * motion.direction
