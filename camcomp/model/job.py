"""Objects built from a configuration: machine, program frame, cutting conditions, effects, engagement."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable
from functools import cached_property, partial
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from camcomp.gcode.program import Program
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats, Path
from camcomp.ground.errors import ConfigError, PhysicsError
from camcomp.ground.records import dataclass, field, replace
from camcomp.ground.vectors import shift
from camcomp.model import signal_path
from camcomp.model.config.base import Spec
from camcomp.model.config.spec import Config
from camcomp.model.config.taken import TakenFromProgram
from camcomp.model.cutting.cut import Cut
from camcomp.model.cutting.engaged import Engaged
from camcomp.model.cutting.track import Conditions, Edges
from camcomp.model.effect import Cause
from camcomp.model.statics.build import build_robot, held_orientation, rotation_of
from camcomp.model.statics.description import Robot
from camcomp.model.statics.machine import Machine, build_machine


@dataclass(frozen=True, eq=False)
class Frame:
    """The program frame (G54 at program start) in the machine frame: machine = origin + rotation @ program."""

    origin: Floats  # (3,) mm
    rotation: Floats  # (3, 3)

    def to_machine(self, points: Floats) -> Floats:
        """Points (n, 3) mm, program to machine frame."""
        return shift(self.vectors(points), self.origin)

    def to_program(self, points: Floats) -> Floats:
        """Points (n, 3) mm, machine to program frame."""
        out = shift(points + 0.0, -self.origin)
        return out @ self.rotation if self._is_turned else out

    def vectors(self, vectors: Floats) -> Floats:
        """Vectors (n, 3), program to machine axes."""
        return vectors @ self.rotation.T if self._is_turned else vectors + 0.0  # no -0.0, as a product has none

    @cached_property
    def _is_turned(self) -> bool:
        """Whether the axes differ; where they do not, a product takes five times as long as a copy."""
        return not np.array_equal(self.rotation, np.eye(3))


@dataclass(frozen=True, eq=False)
class Job:
    """A Config and the objects built from it. taken: its values from comments of the program.

    measured_force: the cutting forces come from a measurement, not from the force model.
    """

    config: Config
    taken: TakenFromProgram = field(default=TakenFromProgram(), kw_only=True)
    measured_force: bool = field(default=False, kw_only=True)

    @cached_property
    def fingerprint(self) -> str:
        """16 hex digits that change with machine, tool, workpiece position, process and effects.

        Files that a section names count by their content; `source` remarks do not count.
        """
        parts = {
            name: _bare(getattr(self.config, name)) for name in ("robot", "workpiece", "tool", "process", "effects")
        }
        if self.config.tools:
            tools = _bare(self.config.tools)
            parts["tools"] = {number: {k: v for k, v in tool.items() if k != "file"} for number, tool in tools.items()}
        for section, keys in _LATER.items():  # keys of later versions: omitted unless they are given
            parts[section] = {key: v for key, v in parts[section].items() if v is not None or key not in keys}
        if self.config.control.absolute_accuracy:
            parts["absolute_accuracy"] = True
        if self.config.uncertain and self.config.compensation.policy != "full":  # then the program depends on them
            parts["policy"] = [self.config.compensation.policy]
            parts["policy"] += [[each.name, each.sd, each.group] for each in self.config.spreads]
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:16]

    @cached_property
    def frame(self) -> Frame:
        """Program frame in the machine frame."""
        return Frame(np.asarray(self.config.workpiece.origin_mm, float), rotation_of(self.config.workpiece.rotation))

    @cached_property
    def machine(self) -> Machine:
        """The machine with its chain errors. Raises ConfigError CC216 if it cannot be built."""
        return self._build(*self._robots)

    @cached_property
    def perfect_machine(self) -> Machine:
        """The same machine with perfect chains."""
        return self._build(self._robots[1], self._robots[1])

    @cached_property
    def causes(self) -> tuple[Cause, ...]:
        """Effects of the config in its order; those on the modelled force only where the force is modelled."""
        causes = tuple(
            Cause(
                each.effect,
                shelf.load("effects", each.effect),
                each.target,
                dict(each.values),
                self.config.at("effects", i, "effect"),
            )
            for i, each in enumerate(self.config.effects)
        )
        if self.config.control.absolute_accuracy:  # the control corrects these itself
            causes = tuple(cause for cause in causes if not getattr(cause.effect, "GEOMETRY", False))
        return signal_path.under_measured_force(causes) if self.has_measured_force else causes

    @property
    def has_measured_force(self) -> bool:
        """Whether the cutting force is measured: given with every set-point, or read from a table."""
        return self.measured_force or self.config.process.force.model == "table"

    @cached_property
    def real_machine(self) -> Machine:
        """The machine with its chain errors and the effects of the config."""
        robot, nominal = self._robots
        changed, by = signal_path.edited(self.causes, tuple(each.name for each in robot.actuators), robot)
        return self._build(changed, nominal) if by else self.machine

    @cached_property
    def correctable(self) -> Job:
        """The job with the effects that set-points can correct."""
        return self.with_causes(cause for cause in self.causes if not cause.uncorrectable)

    def with_causes(self, causes: Iterable[Cause]) -> Job:
        """The job with only these of its effects; itself if those are all."""
        kept = tuple(causes)
        if len(kept) == len(self.causes):
            return self
        other = replace(self)
        vars(other).update(causes=kept, frame=self.frame)
        if len(signal_path.acting(kept, "structure")) == len(signal_path.acting(self.causes, "structure")):
            vars(other)["real_machine"] = self.real_machine  # which may answer by interpolation
        return other

    @cached_property
    def _robots(self) -> tuple[Robot, Robot]:
        """The true robot and the robot of the controller's kinematics, with the orientation that the tool keeps."""
        robots = build_robot(self.config.robot, self.config.tool.tip)
        if self.config.control.absolute_accuracy:  # chain errors are known to the control
            robots = (robots[1], robots[1])
        if len(robots[0].actuators) != 6:
            return robots
        held = held_orientation(robots[1], self.frame.rotation, self.config.tool.turn_deg)
        return replace(robots[0], held=held), replace(robots[1], held=held)

    def _build(self, robot: Robot, nominal: Robot) -> Machine:
        try:
            return build_machine(robot, nominal)
        except ValueError as error:
            raise ConfigError("CC205", str(error), at=self.config.at("robot")) from error

    @cached_property
    def conditions(self) -> Conditions:
        """Cutting conditions for camcomp.cutting.track, with the force model of the config."""
        c = self.config
        choice = c.process.force
        member = shelf.load("forces", choice.model)
        none = choice.model == "none"
        return Conditions(
            model=None if none else partial(_forces, member.force, choice.params, c),
            plunges=bool(getattr(member, "PLUNGES", False)),
            steady=bool(getattr(member, "STEADY", False)),
            tool_axis=self.tool_axis,
            stock_top_mm=c.workpiece.stock_top_mm,
            depth_mm=c.process.depth_mm,
            width_mm=c.process.width_mm,
            spindle_rpm=c.process.spindle_rpm,
            feed_mm_per_min=c.process.feed_mm_per_min,
            diameter_mm=c.tool.diameter_mm,
            teeth=c.tool.teeth,
            to_machine=self.frame.rotation,
            tools={number: Edges(each.diameter_mm, each.teeth) for number, each in c.tools.items()},
            engage=self._engage if c.workpiece.stock else None,
        )

    def engaged(self, program: Program) -> Engaged | None:
        """Engagement along a program; None for a job that states no stock.

        Raises:
            ProgramError: CC142, a rapid moves through material.
            ConfigError: CC295 to CC298, the stock or a tool cannot be simulated.
        """
        if self.config.workpiece.stock is None:
            return None
        return self._engage(program.path, program)

    def _engage(self, path: Path, program: Program | None = None) -> Engaged:
        from camcomp.model.stock.follow import followed  # slow import, needed with a stock only

        return followed(self.config, self.tool_axis, path, program)[0]

    @property
    def tool_axis(self) -> Floats:
        """Unit vector (3,) of the tool axis in the program frame, away from the workpiece."""
        out: Floats = self.frame.rotation.T @ self.machine.nominal.held_rotation[:, 2]
        return out


_LATER = {"workpiece": {"stock"}, "tool": {"type", "corner_radius_mm", "point_deg", "flute_length_mm"}}


def _bare(value: Any) -> Any:
    """A section for the fingerprint: `source` remarks removed, file names replaced by a digest of the content."""
    if isinstance(value, Spec):
        value = {**vars(value), **(value.model_extra or {})}
    if isinstance(value, dict):
        return {str(key): _bare(each) for key, each in value.items() if key != "source"}
    if isinstance(value, list):
        return [_bare(each) for each in value]
    if isinstance(value, str) and FilePath(value).is_absolute() and FilePath(value).is_file():
        return hashlib.sha256(FilePath(value).read_bytes()).hexdigest()
    return value


def _forces(force: Callable[[Cut, Any], Floats], params: Any, config: Config, cut: Cut) -> Floats:
    """Forces (k, 3) N of a model; its errors about missing values get the location of the process section.

    Raises:
        PhysicsError: CC306, a force is not finite; and all errors of the model.
    """
    try:
        found = force(cut, params)
    except ConfigError as error:
        error.at = error.at or config.at("process", "force")
        raise
    bad = ~np.isfinite(found)
    if bad.any():
        line = cut.line[np.nonzero(bad)[0][0]]
        message = f"force model '{config.process.force.model}': the force in program line {line} is not finite"
        raise PhysicsError("CC306", message, at=config.at("process", "force", "model"))
    return found
