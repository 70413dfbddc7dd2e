"""One point at a time, with the least overhead: for programs that arrive line by line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from camcomp.ground.compiled import direct
from camcomp.model.statics.layout import new_memory, new_work
from camcomp.model.statics.machine import Machine
from camcomp.model.statics.rigid import OK
from camcomp.model.statics.sweep import solve_many


class PointSolver:
    """Solver of set-points in mode TARGET or POSE of camcomp.model.statics.point; each starts from the one before.

    Its arrays hold the present point until the next one is solved: rho (m,) to be commanded, rho_nominal (m,) of the
    requested point, mm or rad; drive (m,) N or N mm. After a status other than 0 rho and drive are NaN.
    """

    def __init__(self, machine: Machine, mode: int) -> None:
        m = len(machine.actuators)
        tool = np.ascontiguousarray(machine.robot.tool, float)
        held = np.ascontiguousarray(machine.nominal.held_rotation, float)
        self._longer = (held @ (tool - machine.nominal.tool)).tolist()  # the controller aims with its own tool length
        self._known_tool = machine.nominal.tool.tolist()
        self._near, self._aim, self._force, tip = (np.zeros((1, 3)) for _ in range(4))
        rho, nominal, drive = (np.zeros((1, m)) for _ in range(3))
        self.rho, self.rho_nominal, self.drive = rho[0], nominal[0], drive[0]
        self._command, pose = np.zeros((1, 12)), np.zeros((1, 12))
        self._status, self._passes = np.zeros(1, np.int64), np.zeros(1, np.int64)
        turn = held.reshape(1, 9)
        self._args: tuple[Any, ...] = (
            mode, machine.elastic, machine.rigid, machine.joint_var, tool, machine.start_pose, machine.start_y, True, True,
            turn, turn.copy(), self._near, self._aim, self._force, np.zeros((1, 6)), rho, nominal, self._command, pose, tip, drive,
            np.zeros((1, 6)), self._status, self._passes, np.zeros((0, *machine.elastic.scale.shape)),
            new_memory(machine.elastic, machine.rigid), new_work(machine.elastic, machine.rigid),
        )  # fmt: skip
        self._solve: Callable[..., Any] | None = None

    def solve(self, tip: Sequence[float], force: Sequence[float] = (0.0, 0.0, 0.0)) -> int:
        """Solves for a tip (3,) mm under a force (3,) N, machine frame. Returns one of camcomp.statics.solve.STATUS."""
        x, y, z = tip
        a, b, c = self._longer
        self._aim[0] = x, y, z
        self._near[0] = x + a, y + b, z + c
        self._force[0] = force
        if self._solve is None:
            solve_many(*self._args)
            self._solve = direct(solve_many, self._args)
        else:
            self._solve(*self._args)
        status = self._status.item()
        if status != OK:
            self.rho[:] = self.drive[:] = np.nan
        return status

    @property
    def commanded(self) -> tuple[float, float, float]:
        """Tip (3,) mm to be commanded, machine frame."""
        a, b, c, d, e, f, g, h, i, x, y, z = self._command[0].tolist()
        u, v, w = self._known_tool
        return x + a * u + b * v + c * w, y + d * u + e * v + f * w, z + g * u + h * v + i * w

    @property
    def passes(self) -> int:
        """Passes of Newton's method that the present point took."""
        return int(self._passes[0])
