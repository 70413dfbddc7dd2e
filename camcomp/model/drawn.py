"""Machines within the stated spreads: true values of uncertain inputs against the believed ones of the controller."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from camcomp.ground.datatypes import Floats
from camcomp.ground.records import dataclass, replace
from camcomp.model.config.load import varied
from camcomp.model.config.spread import UncertainInput, uncertain_inputs
from camcomp.model.job import Frame, Job
from camcomp.model.statics.build import build_robot
from camcomp.model.statics.description import Robot


@dataclass(frozen=True, eq=False)
class DrawnJob(Job):
    """A job with one possible true config, whose controller computes with the numbers of the believed job.

    Inverse kinematics, tool length and workpiece position of the controller are those of the believed job; the motion of
    the tip follows the own config.
    """

    believed: Job

    @cached_property
    def frame(self) -> Frame:
        """Program frame of the controller."""
        return self.believed.frame

    @cached_property
    def _robots(self) -> tuple[Robot, Robot]:
        nominal = self.believed._robots[1]
        own, _ = build_robot(self.config.robot, self.config.tool.tip)
        return (replace(own, held=nominal.held) if len(own.actuators) == 6 else own), nominal

    def on_the_workpiece(self, tip: Floats) -> Floats:
        """Tips (n, 3) mm relative to the true workpiece, for tips in the frame of the controller."""
        if self.config.workpiece == self.believed.config.workpiece:
            return tip
        own = Job(self.config).frame
        return own.to_program(self.frame.to_machine(tip))


@dataclass(frozen=True, eq=False)
class UncertainJob:
    """One uncertain input of a job, and the jobs one standard deviation above and below its value; None where refused."""

    source: UncertainInput
    above: DrawnJob | None
    below: DrawnJob | None

    @property
    def sections(self) -> set[str]:
        """Sections of the config that contain the input."""
        return {str(each.keys[0]) for each in self.source.members}

    @property
    def moves_machine(self) -> bool:
        """Whether the machine depends on the input, in addition to the cutting force."""
        return bool(self.sections & {"robot", "tool", "workpiece"})

    @property
    def moves_force(self) -> bool:
        """Whether the cutting force may depend on the input."""
        return bool(self.sections & {"process", "tool", "workpiece"})

    @property
    def sides(self) -> Sequence[DrawnJob]:
        """The jobs above and below that the spec allows."""
        return [each for each in (self.above, self.below) if each is not None]


def uncertain_jobs(job: Job) -> list[UncertainJob]:
    """One UncertainJob per uncertain input of the config."""

    def side(source: UncertainInput, size: float) -> DrawnJob | None:
        config = varied(job.config, source, size)
        return None if config is None else DrawnJob(job.taken.into(config), job)

    return [UncertainJob(each, side(each, 1.0), side(each, -1.0)) for each in uncertain_inputs(job.config.spreads)]
