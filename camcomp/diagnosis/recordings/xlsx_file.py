"""Workbooks of spreadsheets: the first sheet with a table counts."""

from __future__ import annotations

import io
from collections.abc import Sequence
from datetime import datetime
from typing import Any

import numpy as np

from camcomp.diagnosis.recordings.sampled import SampledColumns, library, reading, some
from camcomp.ground.bounds import number_of
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location


def read_xlsx(data: bytes, name: str, names: Sequence[str] = ()) -> list[SampledColumns]:
    """A sheet; names: of its columns, where it has no header. Raises ConfigError CC216, CC421, CC422, CC452."""
    openpyxl = library("openpyxl", "openpyxl", "XLSX files")
    with reading(name, "an XLSX file"):
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        sheets = {sheet.title: [list(row) for row in sheet.iter_rows(values_only=True)] for sheet in book.worksheets}
    filled = {title: rows for title, rows in sheets.items() if sum(map(_is_filled, rows)) > 1}
    if not filled:
        raise ConfigError("CC452", "no sheet of the workbook holds a table", at=Location(name, 1, 1))
    title, others = next(iter(filled)), list(filled)[1:]
    rows = filled[title]
    first = next(i for i, row in enumerate(rows) if _is_filled(row))
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
    lines = [i for i in range(first + headed, len(rows)) if _is_filled(rows[i])]
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
    return [SampledColumns(name, labels, ("",) * len(labels), len(lines), None, read, at, tuple(notes), headed)]


def _is_filled(row: Sequence[Any]) -> bool:
    return any(cell is not None and str(cell).strip() for cell in row)


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
