"""The surface that the loaded machine leaves of the stock."""

from __future__ import annotations

from camcomp.compensation.program.loaded_cut import loaded_cut
from camcomp.gcode.program import Program
from camcomp.ground.errors import ConfigError
from camcomp.model.job import Job
from camcomp.model.stock.surface import Surface, surface_of


def cut_surface(job: Job, program: Program) -> Surface:
    """Surface that a program cuts as written on the loaded machine, effects included.

    Raises ConfigError CC298 without a stock, PhysicsError where the machine cannot be.
    """
    if job.config.workpiece.stock is None:
        message = "there is no stock that could be cut"
        raise ConfigError("CC298", message, at=job.config.at("workpiece"), hint="add workpiece: stock")
    return surface_of(loaded_cut(job, program).memory)
