"""A wrist joint is dragged along: when the joint in front of it turns, it turns by a share of that."""

from collections.abc import Mapping

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter

STAGE = "drive"
TARGET = "actuator"
MOMENTARY = True
PLAIN = "a wrist joint dragged along by the one in front"
REMEDY = "set the coupling factor of the wrist in the control, or master the wrist anew"
ARM_ONLY = True
SOURCE = "drives of hollow wrists pass through the joint in front, whose turn a control has to take out; definition"
ROTARY = (
    Parameter("factor", "1", 0.0, -2.0, 2.0, 3e-4, 1e-6, "what a control's coupling is off by: 1e-5 to 1e-3, or whole"),
)
PARAMETERS = ROTARY


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Joint minus encoder (n, m), rad: the factor times the angle of the joint in front, from its home."""
    factor = p["factor"]
    if factor == 0.0:
        return error
    front = np.zeros_like(error)
    front[:, 1:] = (motion.encoder - motion.home)[:, :-1]
    return error + factor * which * front
