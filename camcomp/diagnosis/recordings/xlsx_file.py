"""Reader of workbooks: the first sheet with a table."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from typing import Any

from camcomp.diagnosis.recordings.sampled import SampledColumns, library, reading, some
from camcomp.diagnosis.recordings.tables import TABLE_RULES, named, of_table
from camcomp.ground.csv_table import MOST_TABLE_BYTES, CsvTable, share_of_numbers
from camcomp.ground.errors import ConfigError, Location

MOST_CELLS = 20_000_000  # as many numbers as a log of five million rows and four columns
MOST_ROWS = 1 << 20  # of a sheet, ECMA-376; its reader keeps something of every row, of empty ones too
DECIMAL_COMMA = ";"  # the mark of a table whose texts may have decimal commas


def read_xlsx(data: bytes, name: str, names: Sequence[str] = ()) -> list[SampledColumns]:
    """Read a sheet; names: of its columns if it has no header. Raises ConfigError CC216, CC421, CC422, CC425, CC452."""
    openpyxl = library("openpyxl", "openpyxl", "XLSX files")
    with reading(name, "an XLSX file"):
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            _refuse_large(sum(each.file_size for each in archive.infolist()), MOST_TABLE_BYTES, "bytes", name)
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        sheets = {sheet.title: _filled_rows(sheet, name) for sheet in book.worksheets}
    filled = {title: rows for title, rows in sheets.items() if len(rows) > 1}
    if not filled:
        raise ConfigError("CC452", "no sheet of the workbook holds a table", at=Location(name, 1, 1))
    title, others = next(iter(filled)), list(filled)[1:]
    lines, rows = list(filled[title]), list(filled[title].values())
    rows[0] += [""] * (max(map(len, rows)) - len(rows[0]))
    headed = share_of_numbers(rows[0], decimal_comma=True) <= 0.5
    if not headed:
        lines, rows = [lines[0], *lines], [[str(j + 1) for j in range(len(rows[0]))], *rows]
    table = CsvTable(
        name=name, rules=TABLE_RULES, mark=DECIMAL_COMMA, header=tuple(rows[0]), rows=tuple(rows[1:]),
        _line=tuple(lines), _source=[], headed=headed,
    )  # fmt: skip
    notes = [f"sheet {title}"] + ([f"dropped sheets: {some(others)}"] if others else [])
    return [of_table(table if headed else named(table, names), notes=notes)]


def _filled_rows(sheet: Any, name: str) -> dict[int, list[str]]:
    """Texts of the cells of rows with text by the number of the row, without trailing empty cells."""
    sheet.reset_dimensions()  # stated dimensions may be far larger than the data
    out: dict[int, list[str]] = {}
    cells = 0
    for i, row in enumerate(sheet.iter_rows(values_only=True)):
        texts = ["" if cell is None else str(cell).strip() for cell in row]
        cells += len(row)
        _refuse_large(cells, MOST_CELLS, "cells", name)
        _refuse_large(i, MOST_ROWS, "rows in a sheet", name)
        if width := max((k + 1 for k, text in enumerate(texts) if text), default=0):
            out[i + 1] = texts[:width]
    return out


def _refuse_large(size: int, most: int, what: str, name: str) -> None:
    if size > most:
        raise ConfigError("CC425", f"the workbook has more than {most:.3g} {what}", at=Location(name, 1, 1))
