"""Corrected programs put through the model again, from their text alone."""

from __future__ import annotations

from pathlib import Path

from camcomp.api.machine import Job, Program, program_in
from camcomp.compensation.program import verify as story
from camcomp.compensation.program.verify import Verified
from camcomp.model.from_program import StockChoice, job_of_program

__all__ = ["Verified", "verify"]


def verify(
    corrected: Program | str | Path | bytes,
    original: Program | str | Path | bytes,
    machine: Job,
    stock: StockChoice | None = None,
) -> Verified:
    """What is left of the error: `.residual` (k,) mm at the points looked at, `.figures(tolerance_um)` as JSON has them.

    stock: where the stock comes from; None: the machine file, or else the comments of the original. Raises CheckFailed CC604 when `corrected` is not one of `original`.
    """
    source = program_in(original, machine)
    machine = job_of_program(machine, source.data, source.name, stock)
    return story.verify(program_in(corrected, machine), source, machine)
