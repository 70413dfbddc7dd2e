"""Friction at the guide: the drive has to push harder along its travel, which winds up its spring."""

from collections.abc import Mapping

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter
from camcomp.model.hysteresis import PRESLIDING_MM, PRESLIDING_RAD, held_back

STAGE = "drive"
TARGET = "actuator"
PLAIN = "friction in the guide"
REMEDY = "clean and lubricate the guide, check covers and preload; run the machine warm before it is measured"
SOURCE = (
    "force balance of the carriage; turn-round of the force after Dahl 1968, on the carriage's way; viscous and Stribeck part by "
    "the speed of the encoder: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083"
)
_LENGTH = (1e-4, 1.0, 0.005, 0.0005, "rolling guides: 1 to 100 um")
_CARRIAGE_WAY = Parameter(
    "carriage_way", "1", 1.0, 0.0, 1.0, 1.0, 0.0,
    "way that turns the friction round: 1 the carriage's, behind its spring; 0 the encoder's", either=(1.0, 0.0),
)  # fmt: skip
FITTED = (
    Parameter("force_N", "N", 0.0, 0.0, 20000.0, 60.0, 0.2, "guides and seals of feed drives: 5 to 300 N", sign=1),
    Parameter("presliding_mm", "mm", PRESLIDING_MM, *_LENGTH, scan=(0.001, 0.003, 0.008, 0.02, 0.06)),
    _CARRIAGE_WAY,
)
_TORQUE = "robot joints: 1 to 5 % of the rated torque"
_ANGLE = (1e-7, 1e-2, 1e-5, 1e-6, "bearings and gears: 1 to 100 urad")
ROTARY = (
    Parameter("force_Nmm", "Nmm", 0.0, 0.0, 5e6, 5e4, 200.0, _TORQUE, sign=1),
    Parameter("presliding_rad", "rad", PRESLIDING_RAD, *_ANGLE, scan=(2e-6, 5e-6, 1.5e-5, 5e-5, 1.5e-4)),
    _CARRIAGE_WAY,
)
_BREAKAWAY = "breakaway force beyond the Coulomb force: 0 to 100 % of it"
# Known where drive forces are logged, or axes by themselves; programs hardly show them.
_MORE = (
    Parameter("viscous_Ns_per_mm", "Ns/mm", 0.0, 0.0, 100.0, 0.2, 0.002, "grease and seals: 0.01 to 1 N s/mm", sign=1),
    Parameter(
        "asymmetry_Ns_per_mm", "Ns/mm", 0.0, -100.0, 100.0, 0.05, 0.001, "viscous forward minus mean of both ways"
    ),
    Parameter("stribeck_N", "N", 0.0, 0.0, 20000.0, 20.0, 0.1, _BREAKAWAY, sign=1),
    Parameter(
        "stribeck_mm_per_s",
        "mm/s",
        1.0,
        0.1,
        1e3,
        0.5,
        0.0,
        "lubricated guides: 0.1 to 20 mm/s",
        scan=(0.1, 1.0, 10.0),
    ),
)
_MORE_ROTARY = (
    Parameter("viscous_Nmms_per_rad", "Nmms/rad", 0.0, 0.0, 1e7, 2e4, 200.0, "gears of arms: 1 to 30 % of the rated torque at rated speed", sign=1),
    Parameter("asymmetry_Nmms_per_rad", "Nmms/rad", 0.0, -1e7, 1e7, 5e3, 100.0, "viscous forward minus mean of both ways"),
    Parameter("stribeck_Nmm", "Nmm", 0.0, 0.0, 5e6, 2e4, 100.0, _BREAKAWAY, sign=1),
    Parameter("stribeck_rad_per_s", "rad/s", 0.02, 0.005, 10.0, 0.01, 0.0, "gears of arms: 0.005 to 0.2 rad/s", scan=(0.005, 0.02, 0.1)),
)  # fmt: skip
COULOMB = ("force_N", "force_Nmm")
PARAMETERS = (FITTED[0], *_MORE, *FITTED[1:], *ROTARY[:2], *_MORE_ROTARY)


def _pull(motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats | None:
    """Friction force (n, m) of the guides of the target actuators, N or Nmm; None at nominal parameters."""
    torque, breakaway = p.get("force_Nmm", 0.0), p.get("stribeck_Nmm", 0.0)
    hinge = torque != 0.0 or breakaway != 0.0
    force, stribeck = p.get("force_N", 0.0) + torque, p.get("stribeck_N", 0.0) + breakaway
    viscous = p.get("viscous_Ns_per_mm", 0.0) + p.get("viscous_Nmms_per_rad", 0.0)
    lopsided = p.get("asymmetry_Ns_per_mm", 0.0) + p.get("asymmetry_Nmms_per_rad", 0.0)
    if force == 0.0 and stribeck == 0.0 and viscous == 0.0 and lopsided == 0.0:
        return None
    length = p.get("presliding_rad", PRESLIDING_RAD) if hinge else p.get("presliding_mm", PRESLIDING_MM)
    slow = p.get("stribeck_rad_per_s", 0.02) if hinge else p.get("stribeck_mm_per_s", 1.0)
    nut = motion.encoder if motion.nut is None else motion.nut
    turned = motion.direction
    if motion.ordered:
        aimed = which > 0
        turned = np.zeros_like(nut)
        with np.errstate(divide="ignore"):
            holding = motion.stiffness[aimed] / p.get("carriage_way", 1.0)
        turned[:, aimed] = held_back(nut[:, aimed], holding, force + stribeck, length)
    sliding = force + stribeck * np.exp(-((motion.speed / slow) ** 2)) if stribeck else force
    return which * (sliding * turned + viscous * motion.speed + lopsided * np.abs(motion.speed))


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Carriage minus encoder (n, m), mm: the spring gives way against the travel."""
    pull = _pull(motion, which, p)
    return error if pull is None else error - pull / motion.stiffness


def on_drive_force(effort: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Force of the drive on its carriage (n, m), N: more by the friction, along the travel."""
    pull = _pull(motion, which, p)
    return effort if pull is None else effort + pull
