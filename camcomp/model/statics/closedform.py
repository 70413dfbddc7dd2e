"""Inverse kinematics in closed form of the common six-axis arm: upright first axis, two parallel arm axes, spherical wrist.

The wrist's centre fixes the first three joints (side, elbow), the orientation the last three (flip): eight branches.
Source: Pieper, "The kinematics of manipulators under computer control" (1968); the steps are Paden-Kahan subproblems
(Murray, Li, Sastry, "A mathematical introduction to robotic manipulation", 1994, section 3.3).
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.records import dataclass
from camcomp.model.statics.arm import Arm, joint_lines
from camcomp.model.statics.rotation import exp_rotation

Array = NDArray[np.float64]
EXACT = 1e-9  # rad, tolerance of parallel and perpendicular axes; times 1000 mm for axes that meet in a point


_BRANCHES = tuple(product((1.0, -1.0), repeat=3))  # side, elbow, flip


@dataclass(frozen=True, kw_only=True)
class ClosedForm:
    """Axes (6, 3) and points on them (6, 3) mm with all joints at zero; the wrist's centre; the platform's pose there."""

    axes: Array
    points: Array
    wrist: Array
    rotation: Array
    position: Array
    branch: int  # of the start pose
    start: Array  # (6,) rad

    def near(self, rotation: Array, position: Array) -> Array | None:
        """Joint coordinates (6,) rad that bring the platform to a pose, in the branch of the start pose; None out of reach."""
        q = self._in_branch(self.branch, *self._wrist_at(rotation, position))
        return None if q is None else q + 2.0 * np.pi * np.round((self.start - q) / (2.0 * np.pi))

    def all(self, rotation: Array, position: Array) -> list[Array | None]:
        """The eight branches, each (6,) rad, or None if the pose is out of reach."""
        at = self._wrist_at(rotation, position)
        return [self._in_branch(branch, *at) for branch in range(len(_BRANCHES))]

    def _wrist_at(self, rotation: Array, position: Array) -> tuple[Array, Array]:
        """Turn (3, 3) of the platform from its start pose, and centre (3,) of the wrist."""
        turn = rotation @ self.rotation.T
        return turn, position + turn @ (self.wrist - self.position)

    def _in_branch(self, branch: int, turn: Array, centre: Array) -> Array | None:
        side, elbow, flip = _BRANCHES[branch]
        arm = self._arm(centre, side, elbow)
        return None if arm is None else np.concatenate((arm, self._wrist(turn, arm, flip)))

    def _arm(self, centre: Array, side: float, elbow: float) -> Array | None:
        z, u = self.axes[0], self.axes[1]
        v = centre - self.points[0]
        offset = (self.wrist - self.points[0]) @ u  # turning the arm axes does not change it
        first = _sine(v @ u, v @ np.cross(z, u), offset, side)
        if first is None:
            return None
        goal = self.points[0] + exp_rotation(-first * z) @ v - self.points[1]
        upper, fore = self.points[2] - self.points[1], self.wrist - self.points[2]
        goal, upper, fore = (a - (a @ u) * u for a in (goal, upper, fore))
        # |upper + Rot(q3) fore| = |goal|
        third = _sine(upper @ fore, upper @ np.cross(u, fore), 0.5 * (goal @ goal - upper @ upper - fore @ fore), elbow)
        if third is None:
            return None
        return np.array([first, _turn(upper + exp_rotation(third * u) @ fore, goal, u), third])

    def _wrist(self, turn: Array, arm: Array, flip: float) -> Array:
        for axis, angle in zip(self.axes[:3], arm, strict=True):
            turn = exp_rotation(-angle * axis) @ turn
        z4, z5, z6 = self.axes[3:]
        fifth = _sine(z4 @ z6, z4 @ np.cross(z5, z6), float(np.clip(z4 @ turn @ z6, -1.0, 1.0)), flip)
        fifth = 0.0 if fifth is None else fifth
        fourth = _turn(exp_rotation(fifth * z5) @ z6, turn @ z6, z4)
        left = exp_rotation(-fifth * z5) @ exp_rotation(-fourth * z4) @ turn
        return np.array([fourth, fifth, _turn(z5, left @ z5, z6)])


def closed_form(arm: Arm) -> ClosedForm | None:
    """Closed form of an arm; None for other arrangements of axes."""
    if len(arm.actuators) != 6 or not all(a.revolute for a in arm.actuators):
        return None
    axes, points, rotation, position = joint_lines(arm, np.zeros(6))
    parallel, square = [(1, 2)], [(0, 1), (3, 4), (4, 5)]
    if any(np.linalg.norm(np.cross(axes[i], axes[j])) > EXACT for i, j in parallel) or axes[1] @ axes[2] < 0.0:
        return None
    if any(abs(axes[i] @ axes[j]) > EXACT for i, j in square):
        return None
    across = [np.eye(3) - np.outer(a, a) for a in axes[3:]]  # least squares: the point nearest to the wrist's axes
    wrist = np.linalg.lstsq(
        np.vstack(across), np.concatenate([a @ p for a, p in zip(across, points[3:], strict=True)]), rcond=None
    )[0]
    if max(float(np.linalg.norm(a @ (wrist - p))) for a, p in zip(across, points[3:], strict=True)) > 1e3 * EXACT:
        return None
    found = ClosedForm(
        axes=axes, points=points, wrist=wrist, rotation=rotation, position=position, branch=0, start=arm.start
    )
    *_, start_rotation, start_position = joint_lines(arm, arm.start)
    misfit = [
        np.inf if q is None else float(np.abs(np.exp(1j * q) - np.exp(1j * arm.start)).max())
        for q in found.all(start_rotation, start_position)
    ]
    best = int(np.argmin(misfit))
    return (
        ClosedForm(
            axes=axes, points=points, wrist=wrist, rotation=rotation, position=position, branch=best, start=arm.start
        )
        if misfit[best] < 1e-6
        else None
    )


def _sine(a: float, b: float, c: float, sign: float) -> float | None:
    """Angle with a cos + b sin = c, rad; None for |c| > hypot(a, b)."""
    size = float(np.hypot(a, b))
    if not size > 0.0 or abs(c) > size:
        return None
    return float(np.arctan2(b, a) + sign * np.arccos(c / size))


def _turn(a: Array, b: Array, axis: Array) -> float:
    """Angle about `axis` that turns a onto b."""
    return float(np.arctan2(axis @ np.cross(a, b), a @ b - (a @ axis) * (b @ axis)))
