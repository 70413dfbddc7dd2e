"""Measured errors of an axis over its travel, one column or one per direction: from CSV, from LinuxCNC, from YAML.

CSV: a column `position_mm`, and either `error_U` or `forward_U` and `reverse_U` with U one of mm, um, rad,
mrad, urad. The error is the true position of the axis minus the reading of its scale. LinuxCNC's file for screws
(COMP_FILE) has three numbers per line: nominal position, then the true positions reached forward and in reverse
(COMP_FILE_TYPE 0), or the corrections added to the command (1).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from camcomp.ground.csv_table import CsvTable, TableRules, like_a_table, read_csv
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import CamcompError, ConfigError, FileError, Location, raise_all
from camcomp.ground.files import display_name, read_bytes
from camcomp.ground.records import dataclass

UNITS = {"mm": 1.0, "um": 1e-3, "rad": 1.0, "mrad": 1e-3, "urad": 1e-6}
LENGTHS = ("mm", "um")
POSITION = "position_mm"


@dataclass(frozen=True, eq=False)
class ErrorTable:
    """Errors of k rows at rising positions (k,), mm or rad, for travel forward and in reverse (k,), mm or rad.

    Linear between rows, constant beyond the ends.
    """

    position: Floats
    forward: Floats
    reverse: Floats
    angle: bool = False

    def at(self, position: Floats, direction: Floats | float) -> Floats:
        """Errors (n,) at positions (n,), reached in directions (n,): +1, -1, or in between."""
        forward = np.interp(position, self.position, self.forward)
        reverse = np.interp(position, self.position, self.reverse)
        return np.asarray(0.5 * (forward + reverse) + 0.5 * direction * (forward - reverse))


def table_of(
    position: Sequence[float], forward: Sequence[float], reverse: Sequence[float] | None, unit: str
) -> ErrorTable:
    """Table from columns of equal length, errors in `unit`. Raises ValueError for inconsistent columns."""
    if len(position) < 2 or np.any(np.diff(position) <= 0.0):
        raise ValueError("positions have to rise from row to row, in two rows at least")
    columns = [forward, forward if reverse is None else reverse]
    if any(len(each) != len(position) for each in columns):
        raise ValueError(
            f"there are {len(position)} positions and {', '.join(str(len(each)) for each in columns)} errors"
        )
    there, back = (UNITS[unit] * np.asarray(each, float) for each in columns)
    return ErrorTable(np.asarray(position, float), there, back, unit not in LENGTHS)


def read_table(name: str, comp_type: int | None) -> ErrorTable:
    """The table in a file: CSV, or LinuxCNC's screw file of that type, in mm. Raises ConfigError CC266, FileError CC500."""
    try:
        stamp = Path(name).stat()
        return _cached(name, comp_type, stamp.st_mtime_ns, stamp.st_size)
    except (OSError, UnicodeDecodeError) as error:
        raise FileError("CC500", f"the error table {display_name(name)} cannot be read: {error}") from error


@lru_cache(maxsize=64)
def _cached(name: str, comp_type: int | None, _time: int, _size: int) -> ErrorTable:
    text = read_bytes(name).decode("utf-8", errors="replace")
    return (
        parse_table(text, display_name(name)) if comp_type is None else parse_comp(text, display_name(name), comp_type)
    )


def parse_table(text: str, name: str) -> ErrorTable:
    """The table in CSV text; `name` is for messages. Raises ConfigError CC266."""
    table = read_csv(text, name, TableRules(table="CC266", column="CC266", cell="CC266"))
    table.refuse_twice()
    if POSITION not in table.header:
        raise ConfigError("CC266", f"no column says where: {POSITION}", at=table.at(-1))
    names, unit = _error_columns(table)
    columns = [table.header.index(each) for each in (POSITION, *names)]
    errors: list[CamcompError] = []
    rows = [[table.required(row, column, errors) for column in columns] for row in range(len(table.rows))]
    raise_all(errors)
    for row in range(1, len(rows)):
        if rows[row][0] <= rows[row - 1][0]:
            raise ConfigError(
                "CC266", f"{POSITION} does not rise: {rows[row - 1][0]:g}, {rows[row][0]:g}", at=table.at(row)
            )
    if len(rows) < 2:
        raise ConfigError("CC266", "an error table has two rows at least", at=table.at(-1))
    values = np.array(rows)
    return table_of(values[:, 0].tolist(), values[:, 1].tolist(), values[:, -1].tolist(), unit)


def _error_columns(table: CsvTable) -> tuple[tuple[str, ...], str]:
    """Names of the one or two columns of errors, and their unit."""
    for unit in UNITS:
        both = (f"forward_{unit}", f"reverse_{unit}")
        if f"error_{unit}" in table.header:
            return (f"error_{unit}",), unit
        if set(both) <= set(table.header):
            return both, unit
    message = "no column holds the error: error_um, or forward_um and reverse_um (mm, um, rad, mrad, urad)"
    raise ConfigError("CC266", message, at=table.at(-1))


def parse_comp(text: str, name: str, comp_type: int) -> ErrorTable:
    """The table in the text of LinuxCNC's file for screws, mm. Raises ConfigError CC266.

    LinuxCNC silently ends the table at the first line that is no triplet; here only blank lines may follow the rows.
    """
    readable = like_a_table(["", *text.splitlines()])
    rows: list[list[float]] = []
    for number, line in enumerate(text.rstrip().splitlines(), 1):
        at = Location(name, number, 1, line if readable else "")
        try:
            values = [float(cell) for cell in line.split()]
        except ValueError:
            values = []
        if len(values) != 3 or not np.isfinite(values).all():
            raise ConfigError("CC266", "the line has to be three numbers: nominal, forward, reverse", at=at)
        if rows and values[0] <= rows[-1][0]:
            raise ConfigError("CC266", f"the nominal position does not rise: {rows[-1][0]:g}, {values[0]:g}", at=at)
        rows.append(values)
    if len(rows) < 2:
        raise ConfigError("CC266", "a screw file has two lines at least", at=Location(name, 1, 1))
    nominal, forward, reverse = np.array(rows).T
    if comp_type == 0:
        return ErrorTable(nominal, forward - nominal, reverse - nominal)
    return ErrorTable(nominal, -forward, -reverse)


def comp_text(table: ErrorTable, comp_type: int) -> str:
    """Text of LinuxCNC's screw file that compensates for a table."""
    there, back = table.forward, table.reverse
    pair = (table.position + there, table.position + back) if comp_type == 0 else (-there, -back)
    rows = zip(table.position, *pair, strict=True)
    return "".join("{:.6f} {:.6f} {:.6f}\n".format(*(value + 0.0 for value in row)) for row in rows)
