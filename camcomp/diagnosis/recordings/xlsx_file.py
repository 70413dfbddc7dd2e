"""Reader of workbooks: the first sheet with a table."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from datetime import datetime
from typing import Any

import numpy as np

from camcomp.diagnosis.recordings.sampled import SampledColumns, library, reading, some
from camcomp.ground.bounds import number_of
from camcomp.ground.csv_table import MOST_TABLE_BYTES
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location

MOST_CELLS = 20_000_000  # as many numbers as a log of five million rows and four columns
MOST_ROWS = 1 << 20  # of a sheet, ECMA-376; its reader keeps something of every row, of empty ones too


def read_xlsx(data: bytes, name: str, names: Sequence[str] = ()) -> list[SampledColumns]:
    """Read a sheet; names: of its columns if it has no header. Raises ConfigError CC216, CC421, CC422, CC452."""
    openpyxl = library("openpyxl", "openpyxl", "XLSX files")
    with reading(name, "an XLSX file"):
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            refuse_large(sum(each.file_size for each in archive.infolist()), MOST_TABLE_BYTES, "bytes", name)
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        sheets = {sheet.title: _filled_rows(sheet, name) for sheet in book.worksheets}
    filled = {title: rows for title, rows in sheets.items() if len(rows) > 1}
    if not filled:
        raise ConfigError("CC452", "no sheet of the workbook holds a table", at=Location(name, 1, 1))
    title, others = next(iter(filled)), list(filled)[1:]
    rows = filled[title]
    first, width = min(rows), max(map(len, rows.values()))
    rows[first] += [None] * (width - len(rows[first]))
    words = [
        isinstance(cell, str) and number_of(cell.replace(",", ".")) is None for cell in rows[first] if cell is not None
    ]
    headed = sum(words) >= 0.5 * len(words)
    header = [str(cell).strip() if cell is not None else "" for cell in rows[first]]
    if not headed:
        header = list(names) or [str(j + 1) for j in range(len(rows[first]))]
    if len(header) != len(rows[first]):
        what = f"{len(names)} names for {len(rows[first])} columns"
        raise ConfigError("CC421", what, at=Location(name, first + 1, 1))
    lines = [i for i in rows if i >= first + headed]
    kept = [j for j, label in enumerate(header) if label not in ("", "-")]

    def at(row: int, k: int) -> Location:
        return Location(name, (first if row < 0 else lines[row]) + 1, kept[k] + 1)

    def read(k: int) -> Floats:
        label = header[kept[k]]
        if header.count(label) > 1:
            raise ConfigError("CC421", f"column {label} stands there twice", at=at(-1, k))
        cells = [rows[i][kept[k]] if kept[k] < len(rows[i]) else None for i in lines]
        return np.array([_number(cell, label, at(row, k)) for row, cell in enumerate(cells)])

    notes = [f"sheet {title}"] + ([f"dropped sheets: {some(others)}"] if others else [])
    labels = tuple(header[j] for j in kept)
    return [
        SampledColumns(
            file=name,
            names=labels,
            units=("",) * len(labels),
            rows=len(lines),
            time=None,
            read=read,
            at=at,
            notes=tuple(notes),
            headed=headed,
        )
    ]


def _filled_rows(sheet: Any, name: str) -> dict[int, list[Any]]:
    """Rows with text by their number from 0, without trailing empty cells."""
    sheet.reset_dimensions()  # stated dimensions may be far larger than the data
    out: dict[int, list[Any]] = {}
    cells = 0
    for i, row in enumerate(sheet.iter_rows(values_only=True)):
        width = max((k + 1 for k, cell in enumerate(row) if _is_filled(cell)), default=0)
        cells += len(row)
        refuse_large(cells, MOST_CELLS, "cells", name)
        refuse_large(i, MOST_ROWS, "rows in a sheet", name)
        if width:
            out[i] = list(row[:width])
    return out


def refuse_large(size: int, most: int, what: str, name: str) -> None:
    """Raise ConfigError CC425 for a size above `most`."""
    if size > most:
        raise ConfigError("CC425", f"the workbook has more than {most:.3g} {what}", at=Location(name, 1, 1))


def _is_filled(cell: Any) -> bool:
    return cell is not None and bool(str(cell).strip())


def _number(cell: Any, label: str, at: Location) -> float:
    """A number, NaN for an empty cell, s since 2000 for a date. Raises ConfigError CC422."""
    if cell is None or (isinstance(cell, str) and not cell.strip()):
        return float("nan")
    if isinstance(cell, datetime):
        return (cell - datetime(2000, 1, 1)).total_seconds()
    number = number_of(cell.strip().replace(",", ".") if isinstance(cell, str) else repr(cell))
    if number is None:
        raise ConfigError("CC422", f"'{cell}' in column {label} is not a number", at=at)
    return number
