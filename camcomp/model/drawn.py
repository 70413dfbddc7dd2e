"""Machines as they may be: what is not known exactly differs from what the control and the compensation take it to be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from camcomp.ground.datatypes import Floats
from camcomp.model.config.load import varied
from camcomp.model.config.spread import UncertainInput, uncertain_inputs
from camcomp.model.job import Frame, Job
from camcomp.model.statics.build import build_robot
from camcomp.model.statics.description import Robot


@dataclass(frozen=True, eq=False)
class DrawnJob(Job):
    """A job whose config is one that may be true; its control goes by the numbers of the job that is believed.

    Geometry, the tool's length and the place of the workpiece are those of the believed job wherever the control computes
    with them, and those of the own config where the tip goes.
    """

    believed: Job

    @cached_property
    def frame(self) -> Frame:
        """Program frame as the control has it."""
        return self.believed.frame

    @cached_property
    def _robots(self) -> tuple[Robot, Robot]:
        nominal = self.believed._robots[1]
        own, _ = build_robot(self.config.robot, self.config.tool.tip)
        return (replace(own, held=nominal.held) if len(own.actuators) == 6 else own), nominal

    def on_the_workpiece(self, tip: Floats) -> Floats:
        """Tips (n, 3), in the frame that the control believes in, as seen from the workpiece."""
        if self.config.workpiece == self.believed.config.workpiece:
            return tip
        own = Job(self.config).frame
        return own.to_program(self.frame.to_machine(tip))


@dataclass(frozen=True, eq=False)
class UncertainJob:
    """A job and one uncertain input of it, a standard deviation above its value and below; None where that is not allowed."""

    source: UncertainInput
    above: DrawnJob | None
    below: DrawnJob | None

    @property
    def sections(self) -> set[str]:
        """Sections of the config that it is in."""
        return {str(each.keys[0]) for each in self.source.members}

    @property
    def moves_machine(self) -> bool:
        """Whether the machine depends on it, not only the cutting force."""
        return bool(self.sections & {"robot", "tool", "workpiece"})

    @property
    def moves_force(self) -> bool:
        """Whether the cutting force may depend on it."""
        return bool(self.sections & {"process", "tool", "workpiece"})

    @property
    def sides(self) -> Sequence[DrawnJob]:
        """The allowed ones."""
        return [each for each in (self.above, self.below) if each is not None]


def uncertain_jobs(job: Job) -> list[UncertainJob]:
    """One for every uncertain input of the config."""

    def side(source: UncertainInput, size: float) -> DrawnJob | None:
        config = varied(job.config, source, size)
        return None if config is None else DrawnJob(job.taken.into(config), job)

    return [UncertainJob(each, side(each, 1.0), side(each, -1.0)) for each in uncertain_inputs(job.config.spreads)]
