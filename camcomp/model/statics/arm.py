"""A serial arm as a rigid chain: forward kinematics and Jacobian of all joints, in plain numpy. mm, rad.

These are the kinematics of an arm's controller; the solver adds joint offsets and elastic links.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.records import dataclass
from camcomp.model.statics.description import Actuator, Chain, Parallelogram, Passive, Robot, Transform
from camcomp.model.statics.rotation import exp_rotation

Array = NDArray[np.float64]
NEAR_SINGULAR = 0.02  # dexterity; an upright wrist reaches it when it is bent by about 5 deg
ARM_LENGTH = 1000.0  # mm, scales rotations against translations: about the reach of an arm


@dataclass(frozen=True)
class Arm:
    """One chain whose only joints are driven. start (m,) coordinates in the start pose."""

    chain: Chain
    actuators: tuple[Actuator, ...]
    start: Array


def arm_of(robot: Robot) -> Arm | None:
    """The robot as an arm; None for several chains or undriven joints."""
    if len(robot.chains) != 1:
        return None
    chain = robot.chains[0]
    if any(isinstance(e, Passive | Parallelogram) for e in chain.elements):
        return None
    drives = robot.actuators
    return Arm(chain, drives, np.array([a.home if a.start is None else a.start for a in drives]))


def end_pose(arm: Arm, q: Array) -> tuple[Array, Array]:
    """Rotation (3, 3) and position (3,) of the platform reference at joint coordinates q (m,), machine frame."""
    R, p, _ = _walk(arm, q)
    return R @ arm.chain.frame.T, p


def jacobian(arm: Arm, q: Array) -> Array:
    """Twist (6, m) of the platform reference per joint rate: translation mm, then rotation rad, machine axes."""
    _, p, joints = _walk(arm, q)
    columns = [
        np.concatenate((np.cross(axis, p - at), axis)) if turns else np.concatenate((axis, np.zeros(3)))
        for axis, at, turns in joints
    ]
    return np.stack(columns, axis=1)


def joint_lines(arm: Arm, q: Array) -> tuple[Array, Array, Array, Array]:
    """Axes (m, 3) and points on them (m, 3) of all joints at q (m,), then the platform's rotation and position."""
    R, p, joints = _walk(arm, q)
    return np.array([axis for axis, _, _ in joints]), np.array([at for _, at, _ in joints]), R @ arm.chain.frame.T, p


def _walk(arm: Arm, q: Array) -> tuple[Array, Array, list[tuple[Array, Array, bool]]]:
    R, p = arm.chain.frame.copy(), np.zeros(3)
    joints = []
    k = 0
    for e in arm.chain.elements:
        if isinstance(e, Transform):
            p = p + R @ e.translation
            R = R @ e.rotation
        elif isinstance(e, Actuator):
            axis = R @ e.axis
            joints.append((axis, p, e.revolute))
            if e.revolute:
                R = R @ exp_rotation(e.axis * q[k])
            else:
                p = p + axis * q[k]
            k += 1
    return R, p, joints


def dexterity(arm: Arm, q: Array) -> Array:
    """Smallest over largest singular value (n,) of the Jacobian at joint coordinates q (n, m): 0 = singular.

    Rotations count times ARM_LENGTH, so that the figure is free of units.
    """
    scale = np.array([1.0, 1.0, 1.0, ARM_LENGTH, ARM_LENGTH, ARM_LENGTH])[:, None]
    slides = np.array([1.0 if a.revolute else ARM_LENGTH for a in arm.actuators])
    stacked = np.array([scale * jacobian(arm, row) * slides for row in q])
    if not len(stacked):
        return np.empty(0)
    sizes = np.linalg.svd(stacked, compute_uv=False)
    return sizes[:, -1] / sizes[:, 0]


def follow(arm: Arm, q: Array, rotation: Array, start: Array, end: Array, step: float = 5.0) -> Array | None:
    """Joint coordinates (m,) at `end` (3,) after a straight motion from `start` (3,), where they are q.

    The platform keeps its rotation (3, 3). None if Newton's method fails on the line. For arms with six joints.
    """
    q = np.array(q, float)
    count = max(int(np.ceil(np.linalg.norm(end - start) / step)), 1)
    for k in range(1, count + 1):
        point = start + (end - start) * (k / count)
        for _ in range(20):
            R, p = end_pose(arm, q)
            gap = np.concatenate((point - p, rotation_vector(rotation @ R.T)))
            try:
                move = np.linalg.solve(jacobian(arm, q), gap)
            except np.linalg.LinAlgError:
                return None
            q += move * min(1.0, 0.3 / max(float(np.abs(move).max()), 1e-300))
            if np.abs(move).max() < 1e-9:
                break
        else:
            return None
    return q


def rotation_vector(R: Array) -> Array:
    """Rotation vector (3,) rad of a rotation (3, 3) of less than half a turn."""
    w = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    s = float(np.linalg.norm(w))
    return w if s < 1e-12 else w * (np.arctan2(s, 0.5 * (np.trace(R) - 1.0)) / s)
