"""Lines of set-points and of their answers, as CSV or JSON: one line in, one line out, whatever stands in it."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from math import isfinite
from typing import NamedTuple

from camcomp.ground.errors import CamcompError, ConfigError

NEEDED = ("x_mm", "y_mm", "z_mm", "fx_N", "fy_N", "fz_N")
TIME = "t_s"
_COLUMN_NAME = re.compile(r"[A-Za-z_]\w*")


class SetPoint(NamedTuple):
    """One line: programmed tip (mm, program frame), force on the tool (N, machine axes), time or None."""

    tip: tuple[float, float, float]
    force: tuple[float, float, float]
    time: float | None


class Reader:
    """Reads lines; a CSV header changes the order of the columns for the lines behind it."""

    def __init__(self) -> None:
        self._order: tuple[int, ...] | None = (0, 1, 2, 3, 4, 5)
        self._time: int | None = 6
        self._count = 7

    def read(self, line: bytes) -> SetPoint | None:
        """The set-point of a line; None for an empty line or a header. Raises ConfigError CC270 for anything else."""
        try:
            text = line.decode("utf-8").strip()
        except UnicodeDecodeError:
            raise ConfigError("CC270", "the line is not UTF-8") from None
        if not text:
            return None
        if text[0] == "{":
            return _from_json(text)
        cells = text.split(",")
        try:
            values = [float(cell) for cell in cells]
        except ValueError:
            if all(_COLUMN_NAME.fullmatch(cell.strip()) for cell in cells):
                self._header([cell.strip() for cell in cells])
                return None
            bad = next(cell for cell in cells if not _is_number(cell))
            raise ConfigError("CC270", f"'{bad.strip()[:40]}' is not a number") from None
        return self._row(values)

    def _header(self, names: list[str]) -> None:
        self._order, self._time = None, None
        _check_names(names)
        self._order = tuple(names.index(name) for name in NEEDED)
        self._time = names.index(TIME) if TIME in names else None
        self._count = len(names)

    def _row(self, v: list[float]) -> SetPoint:
        if self._order is None:
            raise ConfigError("CC270", "the header above this line cannot be used")
        if len(v) != self._count and not (self._count == 7 and self._time == 6 and len(v) == 6):
            raise ConfigError("CC270", f"{len(v)} columns, not {self._count}")
        a, b, c, d, e, f = self._order
        time = v[self._time] if self._time is not None and self._time < len(v) else None
        return _finite(v[a], v[b], v[c], v[d], v[e], v[f], time)


def _from_json(text: str) -> SetPoint:
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ConfigError("CC270", f"no JSON object: {error}") from None
    _check_names(list(data))
    for name, value in data.items():
        if type(value) not in (float, int):
            raise ConfigError("CC270", f"{name} is not a number")
    try:
        x, y, z, fx, fy, fz = (float(data[name]) for name in NEEDED)
        return _finite(x, y, z, fx, fy, fz, float(data[TIME]) if TIME in data else None)
    except OverflowError:
        raise ConfigError("CC270", "a number is too large") from None


def _finite(x: float, y: float, z: float, fx: float, fy: float, fz: float, time: float | None) -> SetPoint:
    if not (isfinite(x + y + z + fx + fy + fz) and (time is None or isfinite(time))):
        raise ConfigError("CC270", "a number is not finite")
    return SetPoint((x, y, z), (fx, fy, fz), time)


def _check_names(names: Sequence[str]) -> None:
    missing = [name for name in NEEDED if name not in names]
    strange = [name for name in names if name not in NEEDED and name != TIME]
    if strange:
        raise ConfigError("CC270", f"'{strange[0][:40]}' is none of {', '.join(NEEDED)}, {TIME}")
    if missing:
        raise ConfigError("CC270", f"{missing[0]} is missing")
    if len(set(names)) < len(names):
        raise ConfigError("CC270", "a name stands twice")


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


class AnswerWriter:
    """Makes the answer lines: CSV with one header, or JSON."""

    def __init__(self, names: Sequence[str], as_json: bool) -> None:
        """names: columns behind time, tip and force, e.g. xc_mm ... act_x_N."""
        self._names = (*NEEDED, *names)
        self._json = as_json
        self.header = "" if as_json else ",".join((TIME, *self._names, "error")) + "\n"
        self._row = ",".join(["%.6f"] * len(self._names))
        self._object = ", ".join(f'"{name}": %.6f' for name in self._names)

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
    return '"' + " ".join(text.replace('"', "'").split()) + '"'
