"""Tables as text: spreadsheets' CSV, blank-separated columns without header, LinuxCNC's halsampler."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.recordings.sampled import SampledColumns
from camcomp.diagnosis.recordings.units import clock, is_unit
from camcomp.ground.bounds import number_of
from camcomp.ground.csv_table import CsvTable, TableRules, read_csv
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location
from camcomp.model.motion.log_columns import TIME

TABLE_RULES = TableRules(table="CC421", column="CC421", cell="CC422")
SERVO_PERIOD_S = 1e-3  # default of LinuxCNC
UNNAMED = "-"  # name of an unused column without header
_OVERRUN = b"overrun"


def read_text_table(
    data: bytes, name: str, names: Sequence[str] = (), period_s: float | None = None
) -> list[SampledColumns]:
    """A table; names: of its columns, if it has no header. Raises ConfigError CC421, CC422."""
    text, notes = _without_remarks(data)
    table = _without_torn_row(read_csv(text, name, TABLE_RULES, spreadsheet=True), notes)
    if table.headed:
        return [of_table(table, notes=notes)]
    counted = table.mark == " " and _counts(table) and not (len(names) == len(table.header) and names[0] == TIME)
    table = named(table, names, counted)
    if not counted:
        return [of_table(table, notes=notes)]
    number = table.value
    period = SERVO_PERIOD_S if period_s is None else period_s
    time = period * np.array([number(i, 0) - number(0, 0) for i in range(len(table.rows))])
    notes.append(f"its first column counts samples of {1e3 * period:g} ms{'' if period_s else ' (--period-s)'}")
    lost = round(number(len(table.rows) - 1, 0) - number(0, 0)) + 1 - len(table.rows)
    if lost:
        notes.append(f"{lost} samples were lost while recording")
    return [of_table(table, range(1, len(table.header)), time, notes=notes)]


def of_table(
    table: CsvTable, columns: Sequence[int] | None = None, time: Floats | None = None, units: Sequence[str] | None = None,
    notes: Sequence[str] = (),
) -> SampledColumns:  # fmt: skip
    """Some columns of a table; cells are read and checked on access. units: of all its columns, else those of its first row."""
    if units is None:
        units = _units_below_names(table)
        table = table.below(1) if units else table
    wanted = range(len(table.header)) if columns is None else columns
    kept = [j for j in wanted if table.header[j] not in ("", UNNAMED)]

    def read(k: int) -> Floats:
        table.refuse_twice([kept[k]])
        times = _clock_times(table, kept[k])
        return table.values([kept[k]])[:, 0] if times is None else times

    def at(row: int, k: int) -> Location:
        return table.at(row, kept[k] if kept else 0)

    names = tuple(table.header[j] for j in kept)
    return SampledColumns(
        file=table.name, names=names, units=tuple(units[j] if units else "" for j in kept), time=time,
        read=read, at=at, notes=tuple(notes), headed=table.headed,
    )  # fmt: skip


def _units_below_names(table: CsvTable) -> list[str]:
    """Units of all columns from the first row, if that holds units in place of numbers; else none."""
    cells = [table.text(0, j).strip("[]()") for j in range(len(table.header))]
    given = [cell for cell in cells if cell]
    words = table.headed and not any(number_of(cell.replace(",", ".")) is not None for cell in given)
    return cells if words and any(is_unit(cell) for cell in given) else []


def _clock_times(table: CsvTable, column: int) -> Floats | None:
    """Seconds since 2000 (n,) of a column of dates or times of day, or None if its first cell is neither.

    Raises ConfigError CC422.
    """
    cells = table.texts(column)
    if clock(next((cell for cell in cells if cell), "")) is None:
        return None
    out = np.full(len(cells), np.nan)
    for row, cell in enumerate(cells):
        if cell:
            found = clock(cell)
            if found is None:
                message = f"'{cell}' in column {table.header[column]} is no date or time like the cells above it"
                raise ConfigError("CC422", message, at=table.at(row, column))
            out[row] = found
    return out


def _without_remarks(data: bytes) -> tuple[bytes, list[str]]:
    """The text with blanks in place of remarks and of halsampler's word for lost samples, and notes with their number."""
    if b"#" not in data and _OVERRUN not in data:
        return data, []
    lines = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    remarks = [i for i, line in enumerate(lines) if line.lstrip().startswith(b"#")]
    overruns = [i for i, line in enumerate(lines) if line.strip() == _OVERRUN]
    for i in (*remarks, *overruns):
        lines[i] = b""
    notes = [f"{len(remarks)} lines of remarks dropped"] if remarks else []
    if overruns:
        notes.append(f"the sampler could not keep up {len(overruns)} times")
    return b"\n".join(lines), notes


def _without_torn_row(table: CsvTable, notes: list[str]) -> CsvTable:
    """The table without an incomplete last row, which a logger stopped while writing leaves."""
    if table.mark != " " or len(table.rows) < 2 or len(table.rows[-1]) >= len(table.rows[-2]):
        return table
    notes.append("the last row ends early: dropped")
    return replace(table, rows=table.rows[:-1])


def _counts(table: CsvTable) -> bool:
    """Whether the first column is the number of the sample: it rises by one, or by more after lost samples."""
    if len(table.rows) < 3:
        return False
    first = np.array([table.value(i, 0) for i in range(len(table.rows))])
    steps = np.diff(first)
    return bool((first == np.round(first)).all() and (steps >= 1.0).all() and np.mean(steps == 1.0) > 0.5)


def named(table: CsvTable, names: Sequence[str], counted: bool = False) -> CsvTable:
    """The table with names; the column of the sample number may have none."""
    if not names:
        return table
    header = ("", *names) if counted and len(names) == len(table.header) - 1 else tuple(names)
    if len(header) != len(table.header):
        message = f"{len(names)} names for {len(table.header)} columns"
        raise ConfigError("CC421", message, at=table.at(-1), hint=f"--columns names all; {UNNAMED} leaves one out")
    return replace(table, header=header)
