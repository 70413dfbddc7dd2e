"""Lines in, lines out: every set-point is answered at once, and no mistake in one ends the stream."""

from __future__ import annotations

import gc
from array import array
from time import perf_counter_ns
from typing import BinaryIO

from camcomp.compensation.set_points.lines import AnswerWriter, Reader
from camcomp.compensation.set_points.stream import Stream
from camcomp.ground.errors import CamcompError, CheckFailed, ConfigError

LONGEST = 1 << 16  # bytes of a line; a set-point has about a hundred


class Tally:
    """Answered set-points and their computing times, counted per microsecond: a stream may last for days."""

    def __init__(self) -> None:
        self._bins = array("q", bytes(8 * 10_001))
        self.count = 0
        self.errors = 0

    def add(self, nanoseconds: int) -> None:
        """One more set-point that was answered."""
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
        """Computing times of the set-points in words; empty without any."""
        if not self.count:
            return ""
        return f"compute: half within {self._within(0.5)} us, 99.9 % within {self._within(0.999)} us; "


def serve(stream: Stream, reader: Reader, writer: AnswerWriter, tally: Tally, source: BinaryIO, sink: BinaryIO) -> None:
    """Answers until the input ends."""
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
