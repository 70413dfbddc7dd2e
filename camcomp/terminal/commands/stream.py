"""camcomp stream."""

from __future__ import annotations

import gc
import sys
from array import array
from time import perf_counter_ns
from typing import TYPE_CHECKING

import click

from camcomp.ground.errors import CamcompError, CheckFailed, ConfigError
from camcomp.model.config.load import load_config
from camcomp.terminal.commands._options import config_option

if TYPE_CHECKING:
    from camcomp.compensation.set_points.lines import AnswerWriter, Reader
    from camcomp.compensation.set_points.stream import Stream

LONGEST = 1 << 16  # bytes of a line; a set-point has about a hundred


@click.command()
@config_option
@click.option("--json", "as_json", is_flag=True, help="Answer in JSON, one object per line; default CSV.")
@click.option(
    "--columns", metavar="NAMES", help="Order of the columns of CSV lines without a header, with commas: t_s,x_mm,..."
)
def command(configs: tuple[str, ...], as_json: bool, columns: str | None) -> None:
    """Compensate single set-points, line by line, from standard input to standard output.

    A line is a JSON object or CSV with x_mm, y_mm, z_mm (tool tip, program frame), fx_N, fy_N, fz_N (force on the tool,
    machine axes) and, if wanted, t_s. --columns, or a CSV header as the first line, gives another order. Every line is
    answered by one line, at once, empty ones too; a line that cannot be read or solved is answered with an error, and the
    stream goes on. Behind a header that cannot be used no CSV line is read. The answers begin with a header of their own,
    which is the answer to yours; in JSON it is {"columns": [...]}. Exit code 1 when there was an error.
    """
    config = load_config(configs)
    from camcomp.compensation.report.tables import actuator_columns
    from camcomp.compensation.set_points.lines import AnswerWriter, Reader
    from camcomp.compensation.set_points.stream import Stream
    from camcomp.model.job import Job

    reader = Reader(columns)
    job = Job(config)
    names = [name for trio in zip(*actuator_columns(job), strict=True) for name in trio]
    writer = AnswerWriter(["xc_mm", "yc_mm", "zc_mm", *names], as_json)
    tally = _Tally()
    stream = Stream(job)
    try:
        _serve(stream, reader, writer, tally)
    finally:
        print(f"{tally.count} set-points, {tally.text()}{tally.errors} errors", file=sys.stderr)
    if tally.errors:
        raise CheckFailed("CC605", f"{tally.errors} of the lines have an error as their answer")


class _Tally:
    """What was answered, and how long set-points took, counted per microsecond: a stream may last for days."""

    def __init__(self) -> None:
        self._bins = array("q", bytes(8 * 10_001))
        self.count = 0
        self.errors = 0

    def add(self, nanoseconds: int) -> None:
        self._bins[min(nanoseconds // 1000, 10_000)] += 1
        self.count += 1

    def _within(self, share: float) -> int:
        seen = 0
        for microseconds, count in enumerate(self._bins):
            seen += count
            if seen >= share * self.count:
                return microseconds + 1
        return len(self._bins)

    def text(self) -> str:
        if not self.count:
            return ""
        return f"compute: half within {self._within(0.5)} us, 99.9 % within {self._within(0.999)} us; "


def _serve(stream: Stream, reader: Reader, writer: AnswerWriter, tally: _Tally) -> None:
    """Answers until the input ends."""
    source, sink = sys.stdin.buffer, sys.stdout.buffer
    sink.write(writer.header.encode())
    sink.flush()
    number = 0
    gc.collect()
    gc.freeze()  # what lives now lives to the end; the collector need not look at it in the middle of a set-point
    while line := source.readline(LONGEST):
        number += 1
        began = perf_counter_ns()
        point = None
        try:
            if len(line) == LONGEST and not line.endswith(b"\n"):
                while (rest := source.readline(LONGEST)) and not rest.endswith(b"\n"):
                    pass
                raise ConfigError("CC270", f"the line is longer than {LONGEST} bytes")
            point = reader.read(line)
            if point is None:
                sink.write(writer.columns(reader.names).encode())
                sink.flush()
                continue
            solved = stream.correct(point.tip, point.force)
            error = None
            if solved.beyond:
                error = CheckFailed("CC602", f"actuator {', '.join(solved.beyond)} leaves its travel")
                tally.errors += 1
            trios = zip(solved.nominal.tolist(), solved.actuators.tolist(), solved.drive.tolist(), strict=True)
            answer = writer.good(point, [*solved.commanded.tolist(), *(each for trio in trios for each in trio)], error)
            tally.add(perf_counter_ns() - began)
        except CamcompError as wrong:
            answer = writer.bad(number, wrong.rule, wrong.message, point)
            tally.errors += 1
        sink.write(answer.encode("utf-8", "backslashreplace"))
        sink.flush()
