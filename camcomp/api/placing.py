"""Where on the table to clamp the workpiece of a program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from camcomp.api.machine import Job, Program, StockChoice, program_in
from camcomp.compensation.placing.report import placing_page, words
from camcomp.compensation.placing.search import MachineTable, PlacingResult, search_place
from camcomp.model.from_program import job_of_program
from camcomp.report.inputs import Input

__all__ = ["MachineTable", "Placed", "PlacingResult", "place", "words"]


@dataclass(frozen=True)
class Placed:
    """Placements of a program. warnings: those of reading it."""

    program: str
    result: PlacingResult
    warnings: tuple[str, ...] = ()

    def report(self, inputs: Sequence[Input] = ()) -> bytes:
        """The page with the map, HTML. Raises ConfigError CC216 without plotly."""
        return placing_page(self.result, Path(self.program).name, inputs)


def place(
    program: Program | str | Path | bytes, machine: Job, table: MachineTable, *, stock: StockChoice | None = None
) -> Placed:
    """Compensate a program at places, turns and start postures, and compare the residual errors.

    Args:
        program: a program, its file, or its bytes.
        machine: of `load_machine`; the height of the workpiece stays as its file states.
        table: the places to try.
        stock: source of the stock; None: the machine file, else the comments of the program.
    """
    source = program_in(program, machine)
    result = search_place(job_of_program(machine, source.data, source.name, stock), source, table)
    return Placed(source.name, result, source.warnings)
