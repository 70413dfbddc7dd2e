"""Simulation: log and machined surface of the modelled machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from camcomp.api.machine import Job, Program, program_in
from camcomp.api.result_table import ResultTable
from camcomp.compensation.program.loaded_cut import cut_surface
from camcomp.model.from_program import StockChoice, job_of_program
from camcomp.model.motion import simulate as story
from camcomp.model.motion.simulate import Simulated
from camcomp.model.oriented import refuse_orientation
from camcomp.model.stock.surface import Surface
from camcomp.report.inputs import Input


@dataclass(frozen=True, eq=False)
class SimulatedLog:
    """A simulated log without noise. outcome: its signals as arrays."""

    outcome: Simulated

    @property
    def warnings(self) -> list[str]:
        """Warnings about the log."""
        return self.outcome.warnings

    @cached_property
    def table(self) -> ResultTable:
        """The log, with the columns that `diagnose` reads."""
        return ResultTable.of_csv(self.to_csv())

    def to_csv(self) -> bytes:
        """The log as the bytes of a CSV file."""
        return story.log_table(self.outcome).encode()


def simulate(
    program: Program | str | Path | bytes, machine: Job, step_s: float = 0.02, *, cutting: bool = True, started_s: float = 0.0,
    stock: StockChoice | None = None,
) -> SimulatedLog:  # fmt: skip
    """Simulate the log of the machine with its `effects:`, with a row every step_s seconds.

    started_s: on the common clock, for effects of warming up. stock: source of the stock; None: the machine file, else the
    comments of the program.

    Raises:
        PhysicsError: a pose of the machine is impossible.
        ConfigError, ProgramError, FileError: as from `load_machine` and `read_program`.
    """
    source = program_in(program, machine)
    machine = job_of_program(machine, source.data, source.name, stock)
    engaged = machine.engaged(source) if cutting else None
    log = story.simulate(machine, source.path, step_s, cutting=cutting, started_s=started_s, engaged=engaged)
    return SimulatedLog(replace(log, warnings=[*source.warnings, *log.warnings]))


def simulate_cut(program: Program | str | Path | bytes, machine: Job, *, stock: StockChoice | None = None) -> Surface:
    """Surface that the loaded machine cuts from the stock. Raises as `simulate`, ConfigError CC298."""
    source = program_in(program, machine)
    refuse_orientation(source, "the machined surface")
    return cut_surface(job_of_program(machine, source.data, source.name, stock), source)


def walls_report(
    program: Program | str | Path | bytes,
    machine: Job,
    inputs: Sequence[Input] = (),
    *,
    stock: StockChoice | None = None,
) -> bytes:
    """One HTML page with the walls that the loaded machine cuts, and their deviations.

    Raises as `simulate_cut`, ConfigError CC216 without the plot library.
    """
    from camcomp.compensation.report.wall_drawing import walls_html

    source = program_in(program, machine)
    refuse_orientation(source, "the machined surface")
    machine = job_of_program(machine, source.data, source.name, stock)
    return walls_html(machine, source, [Input("program", source.name, source.data), *inputs])
