"""Compensation of single set-points: one by one for the user's own controller, or line by line between two streams."""

from __future__ import annotations

from typing import BinaryIO

from camcomp.api.machine import Job
from camcomp.compensation.report.tables import actuator_columns
from camcomp.compensation.set_points.lines import AnswerWriter, Reader, Tally, serve
from camcomp.compensation.set_points.stream import Stream

__all__ = ["Stream", "Tally", "answer_lines"]


def answer_lines(
    machine: Job, source: BinaryIO, sink: BinaryIO, tally: Tally, *, columns: str | None = None, as_json: bool = False
) -> None:
    """Answer every line of `source` with one line in `sink` until it ends; `tally` counts them.

    columns: names in the order of CSV lines without a header. Raises ConfigError CC270 for unusable names.
    """
    reader = Reader(columns)
    names = [name for trio in zip(*actuator_columns(machine), strict=True) for name in trio]
    serve(
        stream=Stream(machine),
        reader=reader,
        writer=AnswerWriter(["xc_mm", "yc_mm", "zc_mm", *names], as_json),
        tally=tally,
        source=source,
        sink=sink,
    )
