"""Torque of a joint of an arm in the masses of all links behind it, in which it is linear.

    tau_j = sum_k m_k z_j . ((c_k - p_j) x (c_k'' + g)),  of a slide z_j . (c_k'' + g)

Ten point masses at PLACES of a link have any mass, first moments and moments of inertia: these are linear in 1, c and c c'.

Source: Atkeson, An, Hollerbach, Int. J. Robotics Research 5 (1986); Siciliano et al., Robotics, 7.2 and 7.3.
"""

from __future__ import annotations

import numpy as np

from camcomp.ground.datatypes import STANDARD_GRAVITY, Floats
from camcomp.ground.records import replace
from camcomp.model.statics.arm import ARM_LENGTH
from camcomp.model.statics.description import Actuator, Chain, Element, Weight
from camcomp.model.statics.masses import moving_bodies

PLACES = ARM_LENGTH * np.vstack([np.zeros(3), np.eye(3), -np.eye(3), 1.0 - np.eye(3)])  # of masses of 1 t, mm


def torque_columns(chain: Chain, joint: int, q: Floats, speed: Floats, acceleration: Floats) -> Floats:
    """Columns (n, 10 per link) of the drive of a joint behind which the links lie, per t of their masses at PLACES.

    q, speed, acceleration (n, m): of all joints, mm or rad, per s, per s^2.
    """
    up = np.array([0.0, 0.0, 1e3 * STANDARD_GRAVITY])
    elements: list[Element] = []
    for e in chain.elements:
        elements += [] if isinstance(e, Weight) else [e]
        behind = sum(isinstance(each, Actuator) for each in elements) > joint
        elements += [Weight(-up, place) for place in PLACES] if behind and isinstance(e, Actuator) else []
    heavy = replace(chain, elements=tuple(elements))
    moving = moving_bodies(heavy, q, speed, acceleration)
    columns = [body.drive(body.joints[joint], speeding + up) for body, speeding in moving]
    return np.stack(columns, axis=1)
