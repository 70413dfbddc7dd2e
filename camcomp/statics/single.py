"""One point at a time, with the least overhead: for programs that arrive line by line."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from camcomp.statics.layout import new_memory, new_work
from camcomp.statics.machine import Machine
from camcomp.statics.rigid import OK
from camcomp.statics.rotation import rotation_vectors
from camcomp.statics.solve import CLAMP, HOLD
from camcomp.statics.sweep import solve_many

Array = NDArray[np.float64]


class PointSolver:
    """Solves points in one mode of camcomp.statics.point; each starts from the one before.

    The arrays it answers with are its own: they hold the present point until the next one is solved.
    tip (3,) loaded, mm; commanded (3,); rho, rho_nominal, drive (m,); force (3,), at the tip; wrench (6,), sum of the
    chains' wrenches at the platform reference; pose (12,), rotation row by row and position; status, passes.
    After a status other than 0 tip, drive, wrench, commanded, pose and rho are NaN.
    """

    def __init__(self, machine: Machine, mode: int, *, check: bool = True) -> None:
        m = len(machine.actuators)
        self.machine, self.mode, self.check = machine, mode, check
        self._tool = np.ascontiguousarray(machine.robot.tool, float)
        self._start = machine.start_pose
        held = np.ascontiguousarray(machine.nominal.held_rotation, float)
        self._held = held.reshape(1, 9)
        self._aim_rotation = self._held.copy()
        self._longer = self._tool - machine.nominal.tool
        self._near_by = held @ self._longer  # the control aims with the tool it knows
        self._near, self._aim, self._force, self._tip = (np.zeros((1, 3)) for _ in range(4))
        self._wrench, self._total = np.zeros((1, 6)), np.zeros((1, 6))
        self._rho, self._nominal, self._drive = (np.zeros((1, m)) for _ in range(3))
        self._command, self._pose = np.zeros((1, 12)), np.zeros((1, 12))
        self._status, self._passes = np.zeros(1, np.int64), np.zeros(1, np.int64)
        self._kept = np.zeros((0, *machine.elastic.scale.shape))
        self._memory = new_memory(machine.elastic, machine.rigid)
        self._work = new_work(machine.elastic, machine.rigid)
        self.tip, self.force, self.wrench, self.pose = self._tip[0], self._force[0], self._total[0], self._pose[0]
        self.rho, self.rho_nominal, self.drive = self._rho[0], self._nominal[0], self._drive[0]
        self.commanded = np.zeros(3)

    def solve(
        self,
        near: ArrayLike,
        *,
        aim: ArrayLike | None = None,
        aim_rotation: ArrayLike | None = None,
        force: ArrayLike = 0.0,
        wrench: ArrayLike = 0.0,
        rho: ArrayLike | None = None,
    ) -> int:
        """Solves one point, arguments as those of camcomp.statics.solve.solve without their first axis. Returns its status."""
        machine = self.machine
        turn = self._held
        if aim_rotation is None:
            self._aim_rotation[0] = self._held[0]
            self._near[0] = self._near_by
        else:
            self._aim_rotation[0] = np.asarray(aim_rotation, float).ravel()
            turn = self._held if self.mode == CLAMP else self._aim_rotation
            self._near[0] = turn.reshape(3, 3) @ self._longer
        self._aim[0] = near if aim is None else aim
        self._near[0] += near
        self._force[0], self._wrench[0] = force, wrench
        if rho is not None:
            self._rho[0] = rho
        solve_many(
            self.mode, machine.elastic, machine.rigid, machine.joint_var, self._tool, self._start, machine.start_y,
            rho is None, self.check, turn, self._aim_rotation, self._near, self._aim, self._force, self._wrench, self._rho,
            self._nominal, self._command, self._pose, self._tip, self._drive, self._total, self._status, self._passes,
            self._kept, self._memory, self._work,
        )  # fmt: skip
        if self._status[0] != OK:
            for a in (self._tip, self._drive, self._total, self._command, self._pose, self._rho):
                a[:] = np.nan
            if self.mode == HOLD:
                self._force[:] = np.nan
        command = self._command[0]
        np.matmul(command[:9].reshape(3, 3), machine.nominal.tool, out=self.commanded)
        self.commanded += command[9:]
        return int(self._status[0])

    @property
    def status(self) -> int:
        """Status of the present point, one of camcomp.statics.solve.STATUS."""
        return int(self._status[0])

    @property
    def passes(self) -> int:
        """Passes of Newton's method that the present point took."""
        return int(self._passes[0])

    @property
    def tilt(self) -> Array:
        """Rotation vector (3,) rad of the platform against the orientation asked for."""
        return rotation_vectors(self._pose[0, :9].reshape(3, 3) @ self._aim_rotation.reshape(3, 3).T)
