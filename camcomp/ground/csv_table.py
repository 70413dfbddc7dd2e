"""Reader of all CSV files: logs, joint tables, measured forces, recordings of other systems.

A file is UTF-8 with or without a byte order mark; lines end in LF, CR LF or CR; blank lines are ignored. The first row names
the columns. Cells may be quoted; an empty cell, a cell missing at the end of a row, and `nan` have no value. Other texts
that are no finite number are refused with their location, and so are cells beyond the last column.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from camcomp.ground.bounds import number_of
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import CamcompError, ConfigError, Location
from camcomp.ground.records import dataclass

MOST_TABLE_ROWS = 5_000_000  # more than an hour at 1 kHz
MOST_TABLE_BYTES = 1 << 30
NEEDED = "a table is a row of column names and rows of numbers below it"
TOO_MANY = "look for a mark too many, or a decimal comma"
LINES_LOOKED_AT = 400
NUMBERS_SHARE = 0.2  # of cells: least share of numbers in a table with errors
_CELLS = re.compile(r"[,;\s]+")
_BLANK = " "  # any number of blanks and tabs between cells


@dataclass(frozen=True)
class TableRules:
    """Rule ids for errors of one kind of table: of the file as a whole, of its columns, of a cell."""

    table: str
    column: str
    cell: str


@dataclass(frozen=True, eq=False, kw_only=True)
class CsvTable:
    """Cells as text, each with its location. header: names of the columns; rows: n rows of cells, of any length.

    headed: the file contains the names; otherwise columns are called 1, 2, 3 and so on. A workbook has no source lines:
    a cell is located by its row and column.
    """

    name: str
    rules: TableRules
    mark: str  # delimiter of cells
    header: tuple[str, ...]
    rows: tuple[list[str], ...]
    _line: tuple[int, ...]  # of the header and of every row, from 1
    _source: list[str]
    headed: bool = True

    def at(self, row: int, column: int = 0) -> Location:
        """Location of a cell; row -1 is the header, or the first row without one. A missing cell is behind the last one."""
        line = self._line[row + 1]
        if not self._source:
            return Location(self.name, line, column + 1)
        source = self._source[line - 1]
        return Location(self.name, line, min(_start(source, self.mark, column), len(source)) + 1, source)

    def text(self, row: int, column: int) -> str:
        """A cell without surrounding blanks; empty if the row ends before it."""
        cells = self.rows[row]
        return cells[column].strip() if column < len(cells) else ""

    def texts(self, column: int) -> list[str]:
        """Cells of a column, as from `text`."""
        return [self.text(row, column) for row in range(len(self.rows))]

    def value(self, row: int, column: int) -> float:
        """Number in a cell, NaN if it is empty. Raises ConfigError for other texts."""
        cell = self.text(row, column)
        if not cell:
            return float("nan")
        number = _number(cell, decimal_comma=self.mark != ",")
        if number is None:
            message = f"'{cell}' in column {self.header[column]} is not a number"
            raise ConfigError(self.rules.cell, message, at=self.at(row, column))
        return number

    def required(self, row: int, column: int, errors: list[CamcompError]) -> float:
        """Number in a cell; for an empty cell NaN, with an error appended to `errors`."""
        try:
            value = self.value(row, column)
        except ConfigError as error:
            errors.append(error)
            return float("nan")
        if np.isnan(value):
            cell = self.text(row, column)
            message = f"'{cell}' in column {self.header[column]} is not a number" if cell else "the cell is empty"
            errors.append(ConfigError(self.rules.cell, message, at=self.at(row, column)))
        return value

    def below(self, count: int) -> CsvTable:
        """The table without its first rows."""
        return replace(self, rows=self.rows[count:], _line=(self._line[0], *self._line[count + 1 :]))

    def values(self, columns: Sequence[int] | None = None) -> Floats:
        """Numbers (n, k) of some columns, default all. Raises ConfigError."""
        wanted = range(len(self.header)) if columns is None else columns
        out = np.empty((len(self.rows), len(wanted)))
        for i in range(len(self.rows)):
            out[i] = [self.value(i, j) for j in wanted]
        return out

    def refuse_twice(self, columns: Sequence[int] | None = None) -> None:
        """Raise ConfigError for a column name (of those given, or of all) that occurs twice."""
        for j in range(len(self.header)) if columns is None else columns:
            first = self.header.index(self.header[j])
            again = next((k for k in range(first + 1, len(self.header)) if self.header[k] == self.header[j]), None)
            if self.header[j] and again is not None:
                message = f"column {self.header[j]} stands there twice"
                raise ConfigError(self.rules.column, message, at=self.at(-1, again))


def read_csv(
    data: bytes | str, name: str, rules: TableRules, *, spreadsheet: bool = False, rowless: bool = False
) -> CsvTable:
    """Read the cells of a CSV file; `name` is the file's for messages. Raises ConfigError.

    spreadsheet: the delimiter may be a semicolon, tab or blank, and numbers may then have decimal commas; a first row with
    mostly numbers is no header. rowless: a header without rows is accepted.
    """
    if len(data) > MOST_TABLE_BYTES:
        raise ConfigError("CC425", f"more than {MOST_TABLE_BYTES} bytes", at=Location(name, 1, 1))
    text = data.decode("utf-8", errors="replace") if isinstance(data, bytes) else data
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    refuse_long(text.count("\n"), "the table", Location(name, 1, 1))
    source = text.split("\n")
    if not like_a_table(source):
        raise ConfigError(
            rules.table, "this is no table of numbers; nothing of it is shown", at=Location(name, 1, 1), hint=NEEDED
        )
    first = next((each for each in source if each.strip()), "")
    mark = _mark(first) if spreadsheet else ","
    lines, rows = _rows(text, mark, name, rules, source)
    if not rows:
        raise ConfigError(rules.table, "the file is empty", at=Location(name, 1, 1), hint=NEEDED)
    headed = not (spreadsheet and share_of_numbers(rows[0], decimal_comma=mark != ",") > 0.5)
    if not headed:
        rows, lines = [[str(j + 1) for j in range(len(rows[0]))], *rows], [lines[0], *lines]
    header = tuple(cell.strip() for cell in rows[0])
    at = Location(name, lines[0], 1, source[lines[0] - 1] if len(rows) > 1 else "")
    if len(header) == 1 and ";" in header[0]:
        raise ConfigError(rules.table, "cells are separated by commas, not by semicolons", at=at)
    if len(rows) < 2 and not rowless:
        raise ConfigError(rules.table, "the table has no rows", at=at, hint=NEEDED)
    table = CsvTable(
        name=name,
        rules=rules,
        mark=mark,
        header=header,
        rows=tuple(rows[1:]),
        _line=tuple(lines),
        _source=source,
        headed=headed,
    )
    for i, row in enumerate(table.rows):
        beyond = next((j for j in range(len(header), len(row)) if row[j].strip()), None)
        if beyond is not None:
            message = f"{len(row)} cells under {len(header)} column{' names' if headed else 's'}"
            raise ConfigError(rules.cell, message, at=table.at(i, beyond), hint=TOO_MANY)
    return table


def like_a_table(lines: Sequence[str]) -> bool:
    """Whether at least NUMBERS_SHARE of the cells below the first line are numbers; True without such lines.

    Error messages quote lines of tables only, because another file may be confidential.
    """
    filled = list(islice((line for line in lines if line.strip()), LINES_LOOKED_AT))
    cells = [cell.strip("\"' ") for line in filled[1:] for cell in _CELLS.split(line)]
    numbers = [number_of(cell) is not None for cell in cells if cell]
    return sum(numbers) >= NUMBERS_SHARE * len(numbers)


def refuse_long(rows: float, what: str, at: Location | None = None) -> None:
    """Raise ConfigError CC425 for more than MOST_TABLE_ROWS rows."""
    if not rows <= MOST_TABLE_ROWS:
        raise ConfigError("CC425", f"{what} has {rows:.3g} rows, more than {MOST_TABLE_ROWS}", at=at)


def _mark(first: str) -> str:
    """Delimiter of the cells of a spreadsheet, found from its first line."""
    for mark in ";\t":
        if mark in first:
            return mark
    words = first.split()
    parted = len(words) > 1 and ("," not in first or share_of_numbers(words, decimal_comma=True) == 1.0)
    return _BLANK if parted else ","


def share_of_numbers(cells: Sequence[str], *, decimal_comma: bool) -> float:
    """Share of numbers among the cells with text, 0 to 1."""
    numbers = [_number(cell.strip(), decimal_comma=decimal_comma) is not None for cell in cells if cell.strip()]
    return sum(numbers) / max(len(numbers), 1)


def _rows(
    text: str, mark: str, name: str, rules: TableRules, source: Sequence[str]
) -> tuple[list[int], list[list[str]]]:
    """First line and cells of every row with text."""
    if mark == _BLANK:
        filled = [(i + 1, line.split()) for i, line in enumerate(source) if line.strip()]
        return [line for line, _ in filled], [cells for _, cells in filled]
    reader = csv.reader(io.StringIO(text), delimiter=mark, skipinitialspace=True, strict=True)
    lines: list[int] = []
    rows: list[list[str]] = []
    start = 1
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                lines.append(start)
                rows.append(row)
            start = reader.line_num + 1
    except csv.Error as error:
        at = Location(name, start, 1, source[start - 1])
        raise ConfigError(rules.table, f"the file is no table: {error}", at=at) from error
    return lines, rows


def _number(cell: str, *, decimal_comma: bool) -> float | None:
    """A number or NaN; None for other texts and numbers out of bounds."""
    return number_of(cell.replace(",", ".") if decimal_comma else cell)


def _start(source: str, mark: str, column: int) -> int:
    """Index of the first character of a cell in its line; the end of the line for a missing cell."""
    if mark == _BLANK:
        starts = [word.start() for word in re.finditer(r"\S+", source)]
        return starts[column] if column < len(starts) else len(source)
    quoted, seen = False, 0
    for i, sign in enumerate(source):
        if seen == column:
            return i
        if sign == '"':
            quoted = not quoted
        elif sign == mark and not quoted:
            seen += 1
    return len(source)
