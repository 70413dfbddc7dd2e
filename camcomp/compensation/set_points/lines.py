"""Lines of set-points and of their answers, as CSV or JSON: one line in, one line out, whatever stands in it.

Every set-point is answered at once, and no mistake in one ends the stream.
"""

from __future__ import annotations

import csv
import gc
import json
import re
from array import array
from collections.abc import Sequence
from math import isnan
from time import perf_counter_ns
from typing import Any, BinaryIO, NamedTuple

from camcomp.compensation.set_points.stream import Stream
from camcomp.ground.bounds import LARGEST_NUMBER, number_of
from camcomp.ground.errors import CamcompError, CheckFailed, ConfigError

LONGEST = 1 << 16  # bytes of a line; a set-point has about a hundred
NEEDED = ("x_mm", "y_mm", "z_mm", "fx_N", "fy_N", "fz_N")
TIME = "t_s"
_NAMES = frozenset((*NEEDED, TIME))
_OF_ROWS = b"0123456789+-.eE, \t\r\n"  # a line of other bytes is no plain row
_LIKE_A_NUMBER = re.compile(r"[+-]?([.\d]|nan$|inf)", re.IGNORECASE)
_MARK = b"\xef\xbb\xbf"  # byte order mark


Triple = tuple[float, float, float]


class SetPoint(NamedTuple):
    """One line: programmed tip (mm, program frame), force on the tool (N, machine axes), time or None."""

    tip: Triple
    force: Triple
    time: float | None


class Reader:
    """Reads lines. Which column is which is settled before the first row is read, and then for good.

    `names` are the columns. They are told beforehand or by a header in front of the rows; without either they are NEEDED
    and TIME in this order. Rows behind a header that cannot be used are refused, for they could stand in any order.
    """

    def __init__(self, columns: str | None = None) -> None:
        """columns: their names with commas between them, if known beforehand. Raises ConfigError CC270."""
        self._known = columns is not None  # the order, by name or by a row that was read in it
        self._begun = False  # a row has been read
        self._started = False  # a line has come
        self._refusing = False  # a header could not be used
        self.names = [*NEEDED, TIME] if columns is None else [each.strip() for each in columns.split(",")]
        _check_names(self.names)
        self._counts = {
            len(self.names),
            6 if columns is None else len(self.names),
        }  # without names time may be left out

    def read(self, line: bytes) -> SetPoint | None:
        """The set-point of a line with its end; None for a header. Raises ConfigError CC270 for anything else."""
        if not line.endswith(b"\n"):
            raise ConfigError("CC270", "the line has no end, so the rest of it may be lost")
        first, self._started = not self._started, True
        if not line.translate(None, _OF_ROWS):
            try:
                return self._row([float(cell) for cell in line.split(b",")])
            except ValueError:
                pass  # e.g. an empty line or cell: said below
        try:
            text = (line.removeprefix(_MARK) if first else line).decode("utf-8").strip()
            if not text:
                raise ConfigError("CC270", "the line is empty")
            if text[0] == "{":
                return _from_json(text)
            cells = _cells(text)
        except (UnicodeDecodeError, csv.Error) as error:
            self._refusing |= not self._known  # it may have been the header
            problem = f"no CSV: {error}" if isinstance(error, csv.Error) else "the line is not UTF-8"
            raise ConfigError("CC270", problem) from None
        if self._is_header(cells, text):
            self._header(cells)
            return None
        return self._row([_number(cell) for cell in ([text] if text[0] == "#" else cells)])

    def _is_header(self, cells: list[str], text: str) -> bool:
        """Whether a line is meant as a header: it names a column, or it comes first and is no row with a mistake in it."""
        if not _NAMES.isdisjoint(cells):
            return True
        row = cells[0] and text[0] != "#" and any(_LIKE_A_NUMBER.match(cell) for cell in cells)
        return not self._known and not row

    def _header(self, names: list[str]) -> None:
        if not self._known:
            self._refusing = True
            _check_names(names)
            self.names, self._counts, self._known, self._refusing = names, {len(names)}, True, False
        elif names != self.names:
            self._refusing = True
            raise ConfigError("CC270", f"a header of other columns than {','.join(self.names)}")
        elif self._begun:
            raise ConfigError("CC270", "a header behind the first row")

    def _row(self, values: list[float]) -> SetPoint:
        if self._refusing:
            raise ConfigError(
                "CC270", "the header above this line cannot be used, so the order of the columns is not known"
            )
        if len(values) not in self._counts:
            raise ConfigError("CC270", f"{len(values)} columns, not {len(self.names)}")
        self._known = self._begun = True
        return _point(dict(zip(self.names, values, strict=False)))


def _cells(text: str) -> list[str]:
    """Cells of a CSV line without blanks and the mark of a comment around them. Raises csv.Error."""
    lines = csv.reader([text.lstrip("# ")], skipinitialspace=True, strict=True)
    return [cell.strip() for cell in next(lines, [])] or [""]


def _number(cell: str) -> float:
    value = number_of(cell)
    if value is None or isnan(value):
        raise ConfigError("CC270", f"'{cell[:40]}' is not a number")
    return value


def _from_json(text: str) -> SetPoint:
    try:
        pairs: list[tuple[str, Any]] = _JSON.decode(text)
    except (ValueError, RecursionError) as error:
        raise ConfigError("CC270", f"no JSON object: {error}") from None
    _check_names([name for name, _ in pairs])
    for name, value in pairs:
        if type(value) not in (float, int):
            raise ConfigError("CC270", f"{name} is not a number")
    try:
        return _point({name: float(value) for name, value in pairs})
    except OverflowError:
        raise ConfigError("CC270", "a number is too large") from None


def _refuse_constant(word: str) -> float:
    raise ValueError(f"{word} is not a number")


_JSON = json.JSONDecoder(object_pairs_hook=list, parse_constant=_refuse_constant)


def _point(cells: dict[str, float]) -> SetPoint:
    x, y, z, fx, fy, fz = (cells[name] for name in NEEDED)
    time = cells.get(TIME)
    size = abs(x) + abs(y) + abs(z) + abs(fx) + abs(fy) + abs(fz)
    if not (size <= LARGEST_NUMBER and (time is None or abs(time) <= LARGEST_NUMBER)):
        raise ConfigError("CC270", f"a number is larger than {LARGEST_NUMBER:g}")
    return SetPoint((x, y, z), (fx, fy, fz), time)


def _check_names(names: Sequence[str]) -> None:
    """Raise ConfigError CC270 unless these are columns; the first may have no name, as that of a data frame's index."""
    named = names[1:] if names and not names[0] else names
    missing = [name for name in NEEDED if name not in named]
    strange = [name for name in named if name not in _NAMES]
    if strange:
        raise ConfigError("CC270", f"'{strange[0][:40]}' is none of {', '.join(NEEDED)}, {TIME}")
    if missing:
        raise ConfigError("CC270", f"{missing[0]} is missing")
    if len(set(named)) < len(named):
        raise ConfigError("CC270", "a name stands twice")


class AnswerWriter:
    """Makes the answer lines: CSV with one header, or JSON."""

    def __init__(self, names: Sequence[str], as_json: bool) -> None:
        """names: columns behind time, tip and force, e.g. xc_mm ... act_x_N."""
        self._names = (*NEEDED, *names)
        self._json = as_json
        self.header = "" if as_json else ",".join((TIME, *self._names, "error")) + "\n"
        self._row = ",".join(["%.6f"] * len(self._names))
        self._object = ", ".join(f'"{name}": %.6f' for name in self._names)

    def columns(self, names: Sequence[str]) -> str:
        """Answer of a header, whose columns were understood as names: as CSV it is the header of the answers."""
        return json.dumps({"columns": list(names)}) + "\n" if self._json else ""

    def good(self, point: SetPoint, values: Sequence[float], error: CamcompError | None = None) -> str:
        """Answer of a solved set-point; values in the order of the names. error: solved, but not to be driven."""
        numbers = (*point.tip, *point.force, *values)
        if self._json:
            time = "" if point.time is None else f'"{TIME}": {point.time!r}, '
            more = "" if error is None else f', "error": "{error.rule}", "message": {json.dumps(error.message)}'
            return "{" + time + self._object % numbers + more + "}\n"
        time = "" if point.time is None else repr(point.time)
        told = "" if error is None else _quoted(f"{error.rule} {error.message}")
        return f"{time},{self._row % numbers},{told}\n"

    def bad(self, line: int, rule: str, message: str, point: SetPoint | None = None) -> str:
        """Answer of a line that could not be read or solved. line: its number in the stream, from 1."""
        if self._json:
            record = {} if point is None or point.time is None else {TIME: point.time}
            return json.dumps({**record, "line": line, "error": rule, "message": message}) + "\n"
        time = "" if point is None or point.time is None else repr(point.time)
        given = [f"{each:.6f}" for each in (*point.tip, *point.force)] if point else [""] * len(NEEDED)
        empty = [""] * (len(self._names) - len(NEEDED))
        return ",".join((time, *given, *empty, _quoted(f"line {line}: {rule} {message}"))) + "\n"


def _quoted(text: str) -> str:
    printable = "".join(each if each.isprintable() else " " for each in text.replace('"', "'"))
    return '"' + " ".join(printable.split()) + '"'


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
