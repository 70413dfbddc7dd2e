"""A long program through its stock, run by run."""

from __future__ import annotations

from typing import BinaryIO

from camcomp.compensation.long.linear_run import LinearRun
from camcomp.compensation.long.runs import InterpretedRun, Runs
from camcomp.gcode.setup import Setup
from camcomp.ground.datatypes import RAPID, Path
from camcomp.ground.errors import Location
from camcomp.ground.records import dataclass
from camcomp.model.cutting.engaged import Engaged
from camcomp.model.job import Job
from camcomp.model.stock.follow import refuse_crashes, refuse_untouched
from camcomp.model.stock.from_config import Bounds, memory_of
from camcomp.model.stock.memory import StockMemory
from camcomp.model.stock.tool_frame import tool_frame_of


@dataclass(eq=False)
class FollowedRuns:
    """The stock of a long program."""

    job: Job
    name: str
    memory: StockMemory

    @classmethod
    def of(cls, job: Job, source: BinaryIO, name: str, setup: Setup) -> FollowedRuns:
        """Set up the stock, reading the program where the stock depends on its bounds or tools."""
        stock, bounds = job.config.workpiece.stock, Bounds()
        assert stock is not None
        if stock.type == "program" or job.config.tools:
            runs = Runs(source=source, name=name, setup=setup, dialect=job.config.control.dialect)
            for run in runs:
                if isinstance(run, LinearRun):
                    if stock.type == "program":
                        bounds.add(run.path)
                    elif (run.linear.kind != RAPID).any():
                        bounds.tools.add(run.state.tool)
                elif isinstance(run, InterpretedRun) and run.motions:
                    bounds.add(runs.program(run).path)
            source.seek(0)
        return cls(job, name, memory_of(job.config, tool_frame_of(job.config, job.tool_axis), bounds))

    def follow(self, path: Path, ahead: Path | None) -> tuple[Engaged, Engaged]:
        """Engagement on the motions of a run, and at the begin of those after it (`ahead`).

        Raises ProgramError CC142 for rapids through material.
        """
        both = path if ahead is None else Path.joined([path, ahead])
        found, crashes = self.memory.follow(both, ahead=0 if ahead is None else len(ahead))
        refuse_crashes(path, crashes, lambda line: Location(self.name, line, 1))
        return found.of_motions(0, len(path)), found.of_motions(len(path), len(both))

    def finish(self) -> None:
        """Raise ConfigError CC298 when nothing was cut."""
        refuse_untouched(self.job.config, self.memory)
