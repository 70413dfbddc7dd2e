"""Torque of a joint of an arm in the inertial parameters of all links behind it, in which it is linear.

    tau_j = z_j . sum_k [ m_k r x a + (c_k x a + r x (w' x c_k + w x (w x c_k))) + I_k w' + w x I_k w ],  r = p_k - p_j

with mass m_k, first moments c_k and inertia I_k of link k about its joint p_k, which has velocity w, w' and acceleration a
minus gravity.

Source: Atkeson, An, Hollerbach, Int. J. Robotics Research 5 (1986); Siciliano et al., Robotics, 7.2 and 7.3.
"""

from __future__ import annotations

import numpy as np

from camcomp.ground.datatypes import STANDARD_GRAVITY, Floats
from camcomp.model.statics.arm import ARM_LENGTH
from camcomp.model.statics.description import Actuator, Chain, Transform
from camcomp.model.statics.rotation import rotations_of


def torque_columns(chain: Chain, joint: int, q: Floats, speed: Floats, acceleration: Floats) -> Floats:
    """Columns (n, 10 per link) of the drive of a joint behind which the links lie, per t of their masses.

    q, speed, acceleration (n, m): of all joints, mm or rad, per s, per s^2. A link has its mass, three first moments and six
    moments of inertia, those of a mass at ARM_LENGTH.
    """
    n = len(q)
    rotation, point = np.broadcast_to(chain.frame, (n, 3, 3)), np.zeros((n, 3))
    turning, speeding = np.zeros((n, 3)), np.zeros((n, 3))
    pull = np.broadcast_to([0.0, 0.0, 1e3 * STANDARD_GRAVITY], (n, 3))
    own, columns, k = None, [], 0
    for e in chain.elements:
        if isinstance(e, Transform):
            r = rotation @ e.translation
            pull = pull + np.cross(speeding, r) + np.cross(turning, np.cross(turning, r))
            point, rotation = point + r, rotation @ e.rotation
        elif isinstance(e, Actuator):
            z, v, a = rotation @ e.axis, speed[:, k, None], acceleration[:, k, None]
            if e.revolute:
                speeding = speeding + z * a + np.cross(turning, z * v)
                turning = turning + z * v
                rotation = rotation @ rotations_of(q[:, k, None] * e.axis)
            else:
                r = q[:, k, None] * z
                pull = pull + np.cross(speeding, r) + np.cross(turning, np.cross(turning, r) + 2.0 * v * z) + a * z
                point = point + r
            own = (z, point, e.revolute) if k == joint else own
            if own is not None:
                columns += _of_link(own, point, rotation, (turning, speeding, pull))
            k += 1
    scale = ARM_LENGTH ** np.tile([0, 1, 1, 1, *[2] * 6], len(columns) // 10)
    return np.stack(columns, axis=1) * scale


def _of_link(
    own: tuple[Floats, Floats, bool], point: Floats, rotation: Floats, motion: tuple[Floats, Floats, Floats]
) -> list[Floats]:
    """Ten columns (n,) of one link in the drive of a joint with axis, point, and whether it is a hinge; motion: w, w', a."""
    (z, about, hinge), (turning, speeding, pull) = own, motion
    forces, moments = [pull], [np.zeros_like(pull)]
    for i in range(3):
        e = rotation[:, :, i]
        forces.append(np.cross(speeding, e) + np.cross(turning, np.cross(turning, e)))
        moments.append(np.cross(e, pull))
    for tensor in _tensors():
        inertia = rotation @ tensor @ rotation.transpose(0, 2, 1)
        spin, more = ((inertia @ each[:, :, None])[:, :, 0] for each in (turning, speeding))
        forces.append(np.zeros_like(pull))
        moments.append(more + np.cross(turning, spin))
    if not hinge:
        return [np.einsum("ni,ni->n", z, f) for f in forces]
    return [np.einsum("ni,ni->n", z, m + np.cross(point - about, f)) for f, m in zip(forces, moments, strict=True)]


def _tensors() -> list[Floats]:
    """Symmetric matrices (3, 3) of one number each: xx, xy, xz, yy, yz, zz."""
    pairs, unit = zip(*np.triu_indices(3), strict=True), np.eye(3)
    return [np.outer(unit[i], unit[j]) + (i != j) * np.outer(unit[j], unit[i]) for i, j in pairs]
