"""Set-points one at a time, as a running control asks for them: exact, each solved from the one before.

In a program of your own: `Stream(Job(load_config(["machine.yaml"]))).correct((x, y, z), (fx, fy, fz))`.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import NamedTuple

import numpy as np

from camcomp.compensation.program.moves import RULE_OF_STATUS
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import PhysicsError
from camcomp.ground.records import replace
from camcomp.model import signal_path
from camcomp.model.finite import not_finite
from camcomp.model.job import Job
from camcomp.model.motion.response import aim_at, aim_pose, respond
from camcomp.model.motion.travel import Travel
from camcomp.model.statics.single import PointSolver
from camcomp.model.statics.solve import POSE, STATUS, TARGET


class Point(NamedTuple):
    """One corrected set-point; every array is new, read it when you like."""

    commanded: Floats  # (3,) mm tip to be commanded, program frame
    nominal: Floats  # (m,) mm or rad, inverse kinematics of the programmed tip
    actuators: Floats  # (m,) mm or rad, to be commanded
    drive: Floats  # (m,) N or N mm, force of the drives under load
    beyond: tuple[str, ...]  # names of actuators outside their travel


class Stream:
    """A machine that answers set-points. Not to be shared between threads.

    Effects of the config that live in the structure, the load, the tool or the drives are part of it; where one depends
    on the direction of travel, that is the way from the set-point before. Forces count as measured: `cutting_force` and
    `tool_wear` leave them as they are.
    """

    def __init__(self, job: Job) -> None:
        """Builds the machine and solves one point, so that the first set-point does not wait for compilation."""
        if signal_path.under_measured_force(job.causes) != job.causes:
            job = replace(job, measured_force=True)
        self._job, self._machine = job, job.real_machine
        self._origin, self._rotation = job.frame.origin.tolist(), job.frame.rotation.tolist()
        self._names = self._machine.actuators
        self._travel = job.machine.limits.tolist()
        self._hooked = any(signal_path.stages_of(cause.effect) - _IN_THE_MACHINE for cause in job.causes)
        self._before: tuple[Floats, Floats] | None = None
        self._tip = PointSolver(self._machine, TARGET)
        self._pose = PointSolver(self._machine, POSE) if len(self._names) == 6 else None
        start = self._machine.nominal
        tip = start.start_reference + start.start_rotation @ np.asarray(start.tool, float)
        for solver in (self._tip, self._pose):
            if solver is not None:
                _refuse(solver.solve(tip))

    def correct(self, tip: Sequence[float], force: Sequence[float]) -> Point:
        """What to command so that the loaded tip is where it is wanted.

        tip (3,) mm in the program frame, force (3,) N on the tool in machine axes. Machines with six actuators get joint
        coordinates that also hold the orientation, as in the joint table of `compensate`. Raises PhysicsError.
        """
        if self._hooked:
            return self._with_effects(np.array(tip, float), np.array(force, float))
        # three numbers are faster one by one than as arrays
        (x, y, z), (u, v, w), ((a, b, c), (d, e, f), (g, h, i)) = tip, self._origin, self._rotation
        target = (u + a * x + b * y + c * z, v + d * x + e * y + f * z, w + g * x + h * y + i * z)
        _refuse(self._tip.solve(target, force))
        x, y, z = self._tip.commanded
        x, y, z = x - u, y - v, z - w
        commanded = np.array((a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z))
        solved = self._tip
        if self._pose is not None:
            solved = self._pose
            _refuse(solved.solve(target, force))
        return self._point(commanded, solved.rho_nominal.copy(), solved.rho.copy(), solved.drive.copy())

    def _point(self, commanded: Floats, nominal: Floats, rho: Floats, drive: Floats) -> Point:
        at = rho.tolist()
        if not isfinite(sum(commanded.tolist()) + sum(nominal.tolist()) + sum(at) + sum(drive.tolist())):
            raise not_finite(self._job.config, "the corrected set-point")
        travel = zip(at, self._travel, self._names, strict=True)
        beyond = tuple([name for at, (low, high), name in travel if at < low or at > high])
        return Point(commanded, nominal, rho, drive, beyond)

    def _with_effects(self, tip: Floats, load: Floats) -> Point:
        """The set-point behind the one before, so that there is a direction of travel."""
        before = self._before or (tip, load)
        tips, loads = np.stack((before[0], tip)), np.stack((before[1], load))
        travel = Travel(force=loads, time=np.array([0.0, 1.0]), cut_min=np.zeros(2), stop=np.zeros(2, np.bool_))
        found = aim_at(self._job, tips, travel, "newton")
        _refuse(int(found.status[1]))
        told = replace(found, commanded=np.where(np.isfinite(found.commanded), found.commanded, tips)).commanded
        if self._pose is None:
            state = respond(self._job, told, travel, tips)[1]
        else:
            state = aim_pose(self._job, told, tips, travel, np.ones(2, np.bool_))
            _refuse(int(state.status[1]))
        if (tip != before[0]).any() or self._before is None:
            self._before = (tip, load)
        return self._point(told[1], state.rho_nominal[1], state.rho[1], state.drive[1])


_IN_THE_MACHINE = {"structure", "sensor"}  # what the solved machine has in it already, and what moves no tip


def _refuse(status: int) -> None:
    if status:
        raise PhysicsError(RULE_OF_STATUS.get(status, "CC301"), STATUS.get(status, "no solution"))
