"""Kinematics that the control computes with: program frame, set-points of poses, and poses of set-points. mm, rad."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from camcomp.ground.datatypes import Floats, Ints, Path
from camcomp.ground.errors import PhysicsError
from camcomp.ground.orientation import rotations_about
from camcomp.ground.records import dataclass
from camcomp.model.statics.arm import ARM_LENGTH
from camcomp.model.statics.description import Robot
from camcomp.model.statics.machine import Machine, build_machine
from camcomp.model.statics.rotation import exp_rotation
from camcomp.model.statics.solve import INVERSE, STATUS, solve

_STEP = 1e-3  # mm or 1e-3 mrad, to first order linear within 1e-6
_KNOT_MM = 0.25  # or mrad / 4: 0.1 um of a circle of 300 mm
_FORWARD_PASSES = 12
_FORWARD_MM = 1e-7
_FORWARD_FAR_MM = 3.0  # step from which Newton's method recomputes its slopes,
_FORWARD_NEAR_MM = 0.3  # and distance from its points for first order


@dataclass(frozen=True, eq=False)
class ControlKinematics:
    """robot: the true machine, nominal: that of the control. origin (3,), rotation (3, 3): program frame in the machine frame."""

    robot: Robot
    nominal: Robot
    origin: Floats
    rotation: Floats

    @cached_property
    def actuators(self) -> tuple[str, ...]:
        """Names in the order of every actuator array."""
        return tuple(each.name for each in self.robot.actuators)

    @cached_property
    def _control(self) -> Machine:
        """The machine of the controller's kinematics."""
        return build_machine(self.nominal, self.nominal)

    def platform(self, path: Path, motion: Ints, u: Floats) -> Floats | None:
        """Orientations (k, 3, 3) of the platform at fractions u (k,) of motions (k,); None for a path without words of orientation."""
        if path.orientation is None:
            return None
        F, turned = self.rotation, path.orientation.rotations(motion, u)
        return np.asarray(F @ turned @ F.T @ self._control.nominal.held_rotation)

    def to_machine(self, tip: Floats) -> Floats:
        """Tips (n, 3) program -> machine frame."""
        return self.origin + tip @ self.rotation.T

    def vectors(self, vectors: Floats) -> Floats:
        """Vectors (n, 3) program -> machine frame."""
        return vectors @ self.rotation.T

    def to_program(self, tip: Floats) -> Floats:
        """Tips (n, 3) machine -> program frame."""
        return (tip - self.origin) @ self.rotation

    def inverse(self, tip: Floats, rotation: Floats | None = None) -> Floats:
        """Set-points (n, m) that the control computes for machine tips (n, 3). Raises PhysicsError CC410.

        rotation (n, 3, 3): of the platform; None: the one that the machine holds.
        """
        state = solve(self._control, INVERSE, tip, aim_rotation=rotation)
        if (state.status == 3).any():
            bad = int(np.argmax(state.status == 3))
            raise PhysicsError("CC410", f"tip {np.round(tip[bad], 3).tolist()} (machine frame) is {STATUS[3]}")
        return state.rho_nominal

    def forward(self, rho: Floats, near: Floats) -> Floats:
        """Forward kinematics of the perfect, unloaded machine: tips (n, 3) of actuators rho (n, m), machine frame.

        near (n, 3): approximate tips. Newton's method on the inverse kinematics at points _KNOT_MM apart, first order
        between them. Raises PhysicsError CC410.
        """
        knots, nearest = _knots(rho * np.where([a.revolute for a in self.robot.actuators], 1000.0, 1.0))
        tip = begun = near[knots]
        off, back = rho[knots] - self.inverse(tip), self._back(tip)
        for _ in range(_FORWARD_PASSES):
            step = np.einsum("nij,nj->ni", back, off)
            tip = tip + step
            size = float(np.abs(step).max(initial=0.0))
            if size < _FORWARD_MM:
                break
            if size > _FORWARD_FAR_MM:
                begun, back = tip, self._back(tip)
            off = rho[knots] - self.inverse(tip)
        if np.abs(tip - begun).max(initial=0.0) > _FORWARD_NEAR_MM:
            back = self._back(tip)
        return np.asarray(tip[nearest] + np.einsum("nij,nj->ni", back[nearest], rho - rho[knots][nearest]))

    def forward_pose(self, rho: Floats, near: Floats, rotation: Floats) -> tuple[Floats, Floats]:
        """Forward kinematics of tip (n, 3) and platform (n, 3, 3) together, machine frame, for six actuators rho (n, 6).

        near (n, 3), rotation (n, 3, 3): approximate pose. Newton's method. Raises PhysicsError CC410.
        """
        tip, turned = near, rotation
        for _ in range(_FORWARD_PASSES):
            off = rho - self.inverse(tip, turned)
            ways = [self.inverse(tip + _STEP * axis, turned) for axis in np.eye(3)]
            ways += [self.inverse(tip, exp_rotation((_STEP / ARM_LENGTH) * axis) @ turned) for axis in np.eye(3)]
            slopes = np.stack(ways, axis=2) - (rho - off)[:, :, None]
            slopes /= np.repeat([_STEP, (_STEP / ARM_LENGTH)], 3)
            step = np.asarray(np.linalg.solve(slopes, off[:, :, None])[:, :, 0], np.float64)
            tip, turned = tip + step[:, :3], rotations_about(step[:, 3:]) @ turned
            if np.abs(step * np.repeat([1.0, ARM_LENGTH], 3)).max(initial=0.0) < _FORWARD_MM:
                break
        return tip, turned

    def _back(self, tip: Floats) -> Floats:
        """Derivatives (n, 3, m) of the tip by the actuators of the perfect machine at machine tips (n, 3)."""
        steps = _STEP * np.eye(3)
        ways = [(self.inverse(tip + e) - self.inverse(tip - e)) / (2 * _STEP) for e in steps]
        back: Floats = np.linalg.pinv(np.stack(ways, axis=2))
        return back


def _knots(rho: Floats) -> tuple[Ints, Ints]:
    """Rows _KNOT_MM of travel apart in the actuators (n, m), mm or mrad, and the nearest of them (n,) for every row."""
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(rho, axis=0)).max(axis=1))])
    knots = np.flatnonzero(np.diff(np.floor(way / _KNOT_MM), prepend=-1.0) > 0)
    right = np.clip(np.searchsorted(way[knots], way), 0, len(knots) - 1)
    left = np.maximum(right - 1, 0)
    return knots, np.where(way - way[knots][left] <= way[knots][right] - way, left, right)
