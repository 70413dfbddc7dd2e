"""Verification of corrected programs by the model, from their text alone."""

from __future__ import annotations

from pathlib import Path

from camcomp.api.machine import Job, Program, program_in
from camcomp.compensation.program import verify as story
from camcomp.compensation.program.result import LineResult
from camcomp.compensation.program.verify import Verified
from camcomp.model.from_program import StockChoice, job_of_program

__all__ = ["LineResult", "Verified", "verify"]


def verify(
    corrected: Program | str | Path | bytes,
    original: Program | str | Path | bytes,
    machine: Job,
    stock: StockChoice | None = None,
) -> Verified:
    """Residual error of a corrected program: `.residual` (k,) mm at the checked points, `.figures(tolerance_um)` for JSON.

    stock: source of the stock; None: the machine file, else the comments of the original. Raises CheckFailed CC604 if
    `corrected` is no correction of `original`.
    """
    source = program_in(original, machine)
    machine = job_of_program(machine, source.data, source.name, stock)
    return story.verify(program_in(corrected, machine), source, machine)
