"""Lines of set-points and of their answers, as CSV or JSON: one line in, one line out, whatever stands in it."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Sequence
from math import isnan
from typing import Any, NamedTuple

from camcomp.ground.bounds import LARGEST_NUMBER, number_of
from camcomp.ground.errors import CamcompError, ConfigError

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
        self._use([each.strip() for each in columns.split(",")] if columns is not None else [*NEEDED, TIME])
        self._short = 6 if columns is None else self._count  # time may be left out where no columns are named

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
            self._use(names)
            self._short, self._known, self._refusing = self._count, True, False
        elif names != self.names:
            self._refusing = True
            raise ConfigError("CC270", f"a header of other columns than {','.join(self.names)}")
        elif self._begun:
            raise ConfigError("CC270", "a header behind the first row")

    def _use(self, names: list[str]) -> None:
        _check_names(names)
        self.names = names
        self._order = tuple(names.index(name) for name in NEEDED)
        self._time = names.index(TIME) if TIME in names else None
        self._count = len(names)

    def _row(self, v: list[float]) -> SetPoint:
        if self._refusing:
            raise ConfigError(
                "CC270", "the header above this line cannot be used, so the order of the columns is not known"
            )
        if len(v) != self._count and len(v) != self._short:
            raise ConfigError("CC270", f"{len(v)} columns, not {self._count}")
        self._known = self._begun = True
        a, b, c, d, e, f = self._order
        time = v[self._time] if self._time is not None and self._time < len(v) else None
        return _bounded((v[a], v[b], v[c]), (v[d], v[e], v[f]), time)


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
    data = dict(pairs)
    _check_names([name for name, _ in pairs])
    for name, value in pairs:
        if type(value) not in (float, int):
            raise ConfigError("CC270", f"{name} is not a number")
    try:
        x, y, z, fx, fy, fz = (float(data[name]) for name in NEEDED)
        return _bounded((x, y, z), (fx, fy, fz), float(data[TIME]) if TIME in data else None)
    except OverflowError:
        raise ConfigError("CC270", "a number is too large") from None


def _refuse_constant(word: str) -> float:
    raise ValueError(f"{word} is not a number")


_JSON = json.JSONDecoder(object_pairs_hook=list, parse_constant=_refuse_constant)


def _bounded(tip: Triple, force: Triple, time: float | None) -> SetPoint:
    size = sum(map(abs, tip)) + sum(map(abs, force))
    if not (size <= LARGEST_NUMBER and (time is None or abs(time) <= LARGEST_NUMBER)):
        raise ConfigError("CC270", f"a number is larger than {LARGEST_NUMBER:g}")
    return SetPoint(tip, force, time)


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
        return f"{time},{self._row % numbers},{_cell(error)}\n"

    def bad(self, line: int, rule: str, message: str, point: SetPoint | None = None) -> str:
        """Answer of a line that could not be read or solved. line: its number in the stream, from 1."""
        if self._json:
            record = {} if point is None or point.time is None else {TIME: point.time}
            return json.dumps({**record, "line": line, "error": rule, "message": message}) + "\n"
        time = "" if point is None or point.time is None else repr(point.time)
        given = [f"{each:.6f}" for each in (*point.tip, *point.force)] if point else [""] * len(NEEDED)
        empty = [""] * (len(self._names) - len(NEEDED))
        return ",".join((time, *given, *empty, _quoted(f"line {line}: {rule} {message}"))) + "\n"


def _cell(error: CamcompError | None) -> str:
    return "" if error is None else _quoted(f"{error.rule} {error.message}")


def _quoted(text: str) -> str:
    printable = "".join(each if each.isprintable() else " " for each in text.replace('"', "'"))
    return '"' + " ".join(printable.split()) + '"'
