"""Where a tracker stands and where its target sits: frame and tool vector that bring an arm's poses onto measured points.

Both are known by this fit alone, so they are nuisances of a campaign and never causes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from camcomp.ground.datatypes import Floats

PASSES = 20
DONE_MM = 1e-9


@dataclass(frozen=True, eq=False)
class Registration:
    """measured = origin + rotation (point + pose tool): rotation (3, 3), origin (3,) mm, tool (3,) mm platform axes."""

    rotation: Floats
    origin: Floats
    tool: Floats

    def to_machine(self, measured: Floats) -> Floats:
        """Measured points (n, 3) in the machine frame."""
        return (measured - self.origin) @ self.rotation

    def tips(self, point: Floats, pose: Floats) -> Floats:
        """Tips (n, 3), machine frame, of platform poses: points (n, 3), rotations (n, 3, 3)."""
        return point + pose @ self.tool

    def moved(self, step: Floats, about: Floats) -> Registration:
        """After a step (9,): turn rad and shift mm of the machine about a point (3,), machine axes, and of the tool."""
        rotation = self.rotation @ Rotation.from_rotvec(step[:3]).as_matrix()
        return Registration(
            rotation, self.origin + self.rotation @ (step[3:6] + about) - rotation @ about, self.tool + step[6:]
        )

    def fitted(self, measured: Floats, tips: Callable[[Registration], Floats], pose: Floats) -> Registration:
        """The best one for measured points (n, 3), by Gauss-Newton steps; tips: modelled points (n, 3) under one. What the poses do
        not show of the tool stays as it was.
        """
        at = self
        for _ in range(PASSES):
            here = tips(at)
            about = here.mean(axis=0)
            N = nuisance_columns(here, pose, about).reshape(-1, 9)
            step = np.linalg.lstsq(N, (at.to_machine(measured) - here).ravel(), rcond=1e-8)[0]
            at = at.moved(np.asarray(step, float), about)
            if np.abs(step[3:]).max() < DONE_MM:
                break
        return at


def register(measured: Floats, point: Floats, pose: Floats, tool: Floats) -> Registration:
    """Best frame and tool for measured points (n, 3) and platform poses; tool (3,) is the start value.

    From the rotation of corresponding points: Kabsch, Acta Cryst. A 32 (1976) 922.
    """
    tips = point + pose @ np.asarray(tool, float)
    middle, there = tips.mean(axis=0), measured.mean(axis=0)
    u, _, vt = np.linalg.svd((tips - middle).T @ (measured - there))
    rotation = vt.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
    start = Registration(rotation, there - rotation @ middle, np.asarray(tool, float))
    return start.fitted(measured, lambda at: at.tips(point, pose), pose)


def nuisance_columns(tips: Floats, pose: Floats, about: Floats) -> Floats:
    """Tip motion (n, 3, 9), machine frame, per unit of a registration's step: turn (rad) and shift (mm) of the frame,
    negated, and tool (mm).

    The columns are those of model tips against measured points that are brought into the machine frame.
    """
    lever = tips - about
    turn = np.zeros((len(tips), 3, 3))
    for i in range(3):
        turn[:, :, i] = np.cross(np.eye(3)[i], lever)
    return np.concatenate([turn, np.broadcast_to(np.eye(3), turn.shape), pose], axis=2)
