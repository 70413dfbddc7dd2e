"""Arms under their own weight at given joint coordinates, many poses at once, in plain numpy. mm, N, rad.

The general solver starts from tips; logs of static poses give joint angles, anywhere and in any posture. A chain whose
only springs are drives and links settles by substitution: deflection = compliance times the generalised load of
the weights at the deflected pose, a contraction for every arm that stands.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.records import dataclass
from camcomp.model.statics.arm import arm_of
from camcomp.model.statics.description import Actuator, Link, Robot, Transform, Weight
from camcomp.model.statics.lengths import LENGTH_STEP_MM, lengthened
from camcomp.model.statics.rotation import rotations_of

Array = NDArray[np.float64]
MOST_PASSES = 50
DONE = 1e-11  # largest change of a deflection, mm or rad


@dataclass(frozen=True)
class Hung:
    """Loaded poses: platform reference (n, 3) mm, rotation (n, 3, 3), torque (n, m) that each drive exerts, N or N mm."""

    point: Array
    rotation: Array
    drive: Array


def hang(robot: Robot, q: Array, wrench: Array | None = None, drive: Array | None = None) -> Hung:
    """Poses at joint coordinates q (n, m) under the weights of the arm and a wrench (n, 6) at the platform reference.

    drive (n, m): measured torque or force of the drives, N mm or N, in place of the modelled one; NaN where none is known.

    Raises ValueError for a machine that is no arm, ArithmeticError if the deflections diverge.
    """
    arm = arm_of(robot)
    if arm is None:
        raise ValueError("not an arm: several chains, or joints without a drive")
    chain = arm.chain
    compliance: list[Array] = []  # one block per spring, base to end
    for e in chain.elements:
        if isinstance(e, Actuator):
            compliance.append(np.array([[0.0 if e.stiffness is None else 1.0 / e.stiffness]]))
        elif isinstance(e, Link):
            C = np.zeros((6, 6))
            on = np.ix_(e.active, e.active)
            C[on] = np.linalg.inv(e.stiffness[on])
            compliance.append(C)
    z = [np.zeros((len(q), len(C))) for C in compliance]
    for _ in range(MOST_PASSES):
        point, rotation, loads = _walk(robot, q, z, wrench)
        if drive is not None:
            loads = _with_measured(loads, drive)
        new = [load @ C for load, C in zip(loads, compliance, strict=True)]
        change = max((float(np.abs(a - b).max(initial=0.0)) for a, b in zip(new, z, strict=True)), default=0.0)
        z = new
        if not np.isfinite(change) or change > 1e3:
            break
        if change < DONE:
            drives = [load[:, 0] for load, C in zip(loads, compliance, strict=True) if len(C) == 1]
            return Hung(point, rotation, -np.stack(drives, axis=1))
    raise ArithmeticError("the arm gives way under its own weight")


def tool_wrench(robot: Robot, q: Array, force: Array) -> Array:
    """Wrench (n, 6) N, N mm at the platform reference of forces (n, 3) N on the tool tip of an arm at coordinates q (n, m)."""
    if not force.any():
        return np.zeros((len(q), 6))
    return np.hstack([force, np.cross(hang(robot, q).rotation @ robot.tool, force)])


def _with_measured(loads: list[Array], drive: Array) -> list[Array]:
    """Loads (n, 1 or 6) on every spring, those on drives as measured torques (n, m) balance them where these are known."""
    measured = iter(-drive.T[:, :, None])
    own = [next(measured) if load.shape[1] == 1 else load for load in loads]
    return [np.where(np.isnan(each), load, each) for each, load in zip(own, loads, strict=True)]


def grown_way(robot: Robot, q: Array, grown: Array) -> Array:
    """Displacement (n, 3) mm of the platform at joint coordinates q (n, m) by links longer by `grown` (n, m) mm."""
    out = np.zeros((len(q), 3))
    for j in np.flatnonzero(grown.any(axis=0)):
        longer = lengthened(robot, robot.actuators[j].name, LENGTH_STEP_MM)
        way = hang(longer, q).point - hang(robot, q).point
        out += way / LENGTH_STEP_MM * grown[:, j, None]
    return out


def _walk(robot: Robot, q: Array, z: list[Array], wrench: Array | None) -> tuple[Array, Array, list[Array]]:
    """End pose at deflections z, and the generalised load (n, 1 or 6) of weights and wrench on every spring."""
    chain, n = robot.chains[0], len(q)
    R = np.broadcast_to(chain.frame, (n, 3, 3)).copy()
    p = np.zeros((n, 3))
    pulls: list[tuple[int, Array, Array]] = []  # springs in front, force (3,), point (n, 3)
    axes: list[tuple[Array, Array, bool | None, Array]] = []  # axis or frame, point, turns (None: link), own rotation
    k = 0

    def rigid(translation: Array, rotation: Array) -> None:
        nonlocal p, R
        p = p + R @ translation
        R = R @ rotation

    if chain.base_error.any():
        rigid(chain.base_error[:3], rotations_of(chain.base_error[None, 3:])[0])
    for e in chain.elements:
        if isinstance(e, Transform):
            rigid(e.translation, e.rotation)
        elif isinstance(e, Actuator):
            axis = R @ e.axis
            axes.append((axis, p, e.revolute, R))
            value = q[:, k] + z[len(axes) - 1][:, 0]
            k += 1
            if e.revolute:
                R = R @ rotations_of(value[:, None] * e.axis)
            else:
                p = p + axis * value[:, None]
        elif isinstance(e, Link):
            own = z[len(axes)]
            p = p + np.einsum("nij,nj->ni", R, own[:, :3])
            axes.append((own[:, 3:], p, None, R))
            R = R @ rotations_of(own[:, 3:])
        elif isinstance(e, Weight):
            pulls.append((len(axes), np.asarray(e.force, float), p + R @ e.centre))
    if chain.end_error.any():
        rigid(chain.end_error[:3], rotations_of(chain.end_error[None, 3:])[0])
    loads = []
    for j, (axis, at, turns, frame) in enumerate(axes):
        force, moment = np.zeros((n, 3)), np.zeros((n, 3))
        for behind, pull, where in pulls:
            if behind > j:
                force = force + pull
                moment = moment + _cross(where - at, pull)
        if wrench is not None:
            force = force + wrench[:, :3]
            moment = moment + wrench[:, 3:] + _cross(p - at, wrench[:, :3])
        if turns is None:
            local = np.einsum("nji,nj->ni", frame, moment)
            loads.append(np.concatenate((np.einsum("nji,nj->ni", frame, force), _left_transposed(axis, local)), axis=1))
        else:
            loads.append(np.einsum("ni,ni->n", axis, moment if turns else force)[:, None])
    return p, R @ chain.frame.T, loads


def _cross(a: Array, b: Array) -> Array:
    """Cross products of vectors in the last axis, faster than numpy.cross for few vectors."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx), axis=-1)


def _left_transposed(w: Array, moment: Array) -> Array:
    """J_l(w)^T moment for the small turns of links: the work of a moment per unit of the rotation vector, to third order."""
    first = _cross(moment, w)
    return moment + 0.5 * first + _cross(first, w) / 6.0
