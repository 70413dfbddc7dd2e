"""The machine around an axis: loads on its drive, columns of the bodies behind it, effects that its file states, motion of other
axes, and how far their errors move the tip.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from camcomp.diagnosis.axis.effect_columns import DrivenAxis
from camcomp.diagnosis.axis.findings import ROWS, AxisRun, lever_mm
from camcomp.diagnosis.axis.rigid_bodies import torque_columns
from camcomp.diagnosis.axis.terms import WIDE, AxisTravel, travel
from camcomp.diagnosis.fit.measured import Measured
from camcomp.ground.datatypes import STANDARD_GRAVITY, Floats
from camcomp.model import signal_path
from camcomp.model.effect import Cause, Motion
from camcomp.model.law.covariates import loads_along
from camcomp.model.statics.arm import ARM_LENGTH, arm_of
from camcomp.model.statics.description import Actuator, Robot
from camcomp.model.statics.hanging import hang, tool_wrench
from camcomp.model.statics.masses import has_moved_mass, mass_loads

Errors = Mapping[str, tuple[Floats, Floats]]  # by axis: times (n,) s and errors (n,) mm or rad


@dataclass(frozen=True, eq=False)
class AxisSurroundings:
    """The machine around an axis, and how all axes moved: loads on its drive, and the way of the tip by errors of actuators.

    axes: runs by axis name, in the study's mm per lever.
    """

    robot: Robot | None
    axes: Mapping[str, Sequence[AxisRun]]

    def driven(self, name: str, run: AxisRun) -> DrivenAxis:
        """One run of an axis with the loads of the stated masses on its drive."""
        none = np.zeros(len(run.time))
        free = Actuator(name=name, revolute=run.revolute, axis=np.array([0.0, 0.0, 1.0]), stiffness=None)
        actuator = next((a for a in self.robot.actuators if a.name == name), None) if self.robot is not None else None
        bare = DrivenAxis(run=run, actuator=actuator or free, lever=lever_mm(run.revolute), weight=none, inertia=none)
        if self.robot is None or actuator is None:
            return bare
        if arm_of(self.robot) is None or not has_moved_mass(self.robot, name):
            return bare
        j, q = self.index(name), self.coordinates(run.name, run.time)
        inertia = mass_loads(self.robot, q, run.time).drive[:, j]
        weight = hang(self.robot, q).drive[:, j]
        return replace(bare, weight=weight, inertia=inertia, stated_loads=self._loads_behind(name, run))

    def coordinates(self, run: str, time: Floats) -> Floats:
        """Coordinates (n, m) of all actuators in a run, mm or rad; an axis that is not logged stands at its start."""
        assert self.robot is not None
        out = []
        for a in self.robot.actuators:
            own = next((r for r in self.axes.get(a.name, ()) if r.name == run), None)
            known = np.isfinite(own.encoder) if own is not None else np.zeros(0, bool)
            if own is None or not known.any():
                out.append(np.full(len(time), a.home if a.start is None else a.start))
            else:
                out.append(np.interp(time, own.time[known], own.encoder[known]) / lever_mm(own.revolute))
        return np.stack(out, axis=1)

    def _loads_behind(self, name: str, run: AxisRun) -> Callable[[Motion, Floats], tuple[Floats, Floats]]:
        """Function that returns the loads (n, 1) of the stated masses on an axis at positions (n, 1), while the others move as
        local cubics of their encoders do.
        """
        robot, at = self.robot, self.index(name)
        assert robot is not None
        others = cache(partial(self.others, name, run, WIDE[0]))

        def loads(motion: Motion, q: Floats) -> tuple[Floats, Floats]:
            every = self.coordinates(run.name, motion.time)
            for other, own in others().items():
                way = Akima1DInterpolator(own.time, own.position / self._lever(other))
                every[:, self.index(other)] = way(np.clip(motion.time, own.time[0], own.time[-1]))
            every[:, at] = q[:, 0]
            weight, inertia = loads_along(robot, motion, every)
            return weight[:, [at]], inertia[:, [at]]

        return loads

    def bodies(self, name: str, run: AxisRun, moved: AxisTravel, wide: int) -> tuple[Floats, Floats]:
        """Columns (n, c) of the bodies behind a hinge in its torque, and their part that is weight.

        Sine and cosine of its angle are among them: a hinge that is upright by the machine file may be mounted otherwise.
        """
        angle = moved.position / lever_mm(True)
        weight = 1e3 * STANDARD_GRAVITY * ARM_LENGTH * np.stack([np.sin(angle), np.cos(angle)], axis=1)
        arm = None if self.robot is None else arm_of(self.robot)
        if arm is None or self.robot is None:
            return weight, weight
        q = self.coordinates(run.name, moved.time)
        speed, acceleration = np.zeros_like(q), np.zeros_like(q)
        for other, own in (self.others(name, run, wide) | {name: moved}).items():
            j, lever = self.index(other), self._lever(other)
            speed[:, j] = np.interp(moved.time, own.time, own.speed) / lever
            acceleration[:, j] = np.interp(moved.time, own.time, own.acceleration) / lever
        at = self.index(name)
        still = np.zeros_like(q)
        moving = torque_columns(arm.chain, at, q, speed, acceleration)
        resting = torque_columns(arm.chain, at, q, still, still)
        return np.column_stack([moving, weight]), np.column_stack([resting, weight])

    def without_effects(self, name: str, run: AxisRun, causes: Sequence[Cause], log: Measured) -> AxisRun:
        """A run of an axis minus effects of the machine file and, on an arm, minus the torque against a dynamometer.

        Rows are left out as long as the following error depends on how the axis moved before the log began. log: of the run.
        """
        if len(run.time) < ROWS or not (causes or log.has("dyno")):
            return run
        warm = np.isfinite(log.temperature)
        temperature = np.interp(run.time, log.time[warm], log.temperature[warm]) if warm.any() else None
        axis = replace(self.driven(name, run), temperature=temperature)
        force = run.force - axis.channel("force", causes)
        if log.has("dyno") and self.robot is not None and arm_of(self.robot) is not None:
            q = self.coordinates(run.name, run.time)
            wrench = tool_wrench(self.robot, q, log.force()[run.numbers - 1])
            against = hang(self.robot, q, wrench).drive - hang(self.robot, q).drive
            force = force - against[:, self.index(name)] / axis.lever
        run = replace(run, force=force, load=None if run.load is None else run.load - axis.channel("behind", causes))
        servo = signal_path.acting(causes, "control")
        if not servo or not np.isfinite(run.setpoint).all():
            return run
        late = axis.channel("following", servo)
        return replace(run, expected=-late, stated=servo).of(axis.known(servo)) if late.any() else run

    def others(self, name: str, run: AxisRun, wide: int) -> dict[str, AxisTravel]:
        """How the other axes moved in the same run."""
        out = {}
        for other, runs in self.axes.items():
            own = next((r for r in runs if r.name == run.name), None)
            if other == name or own is None or len(own.time) < ROWS:
                continue
            if np.isfinite(own.encoder).all() and np.ptp(own.encoder) > 0.0:
                out[other] = travel(own.time, own.encoder, wide)
        return out

    def _lever(self, name: str) -> float:
        """Way of an actuator in the study's mm per unit of its coordinate."""
        assert self.robot is not None
        return lever_mm(self.robot.actuators[self.index(name)].revolute)

    def index(self, name: str) -> int:
        """Number of an actuator."""
        assert self.robot is not None
        return [a.name for a in self.robot.actuators].index(name)

    def errors(self, run: str, errors: Errors) -> Floats:
        """Distances (n,) mm of the tip in a run, at the times of the axis with the most rows."""
        time = max((t for t, _ in errors.values()), key=len)
        own = np.column_stack([
            np.interp(time, *errors[name]) / lever_mm(hinge) if name in errors else np.zeros(len(time))
            for name, hinge in self._actuators
        ])  # fmt: skip
        return self._way_of_tip(run, time, own)

    def floor(self, run: str, time: Floats, floors: Mapping[str, float]) -> Floats:
        """Standard deviations (n,) mm of the tip, of floors by axis."""
        each = np.array([floors.get(name, 0.0) / lever_mm(hinge) for name, hinge in self._actuators])
        ways = [self._way_of_tip(run, time, np.tile(one, (len(time), 1))) for one in np.diag(each)[each > 0.0]]
        return np.asarray(np.sqrt(np.sum(np.square([np.zeros(len(time)), *ways]), axis=0)))

    @property
    def _actuators(self) -> list[tuple[str, bool]]:
        """Names, and whether they turn."""
        if self.robot is None:
            return [(name, any(r.revolute for r in runs)) for name, runs in self.axes.items()]
        return [(a.name, a.revolute) for a in self.robot.actuators]

    def _way_of_tip(self, run: str, time: Floats, by: Floats) -> Floats:
        """Distances (n,) mm by which errors (n, m) of all actuators move the tip; a slide of a machine that is no arm moves it by
        its own error.
        """
        if self.robot is None or arm_of(self.robot) is None:
            return np.asarray(np.linalg.norm(by, axis=1))
        q = self.coordinates(run, time)
        here, there = (
            hung.point + hung.rotation @ self.robot.tool for hung in (hang(self.robot, q), hang(self.robot, q + by))
        )
        return np.asarray(np.linalg.norm(there - here, axis=1))
