"""Tables of numbers from CSV files: logs, joint tables, measured forces."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location
from camcomp.ground.files import display_name, read_bytes


def read_table(path: str) -> dict[str, Floats]:
    """Columns (n,) by name; empty cells are NaN. Raises ConfigError CC450, FileError CC500."""
    name = display_name(path)
    text = read_bytes(path).decode("utf-8-sig", errors="replace")
    reader = csv.reader(io.StringIO(text))
    heads = [each.strip() for each in next(reader, [])]
    if not any(heads):
        raise ConfigError("CC450", "the file is empty", at=Location(name, 1, 1))
    twice = sorted({each for each in heads if heads.count(each) > 1})
    if twice:
        raise ConfigError(
            "CC450", f"column {twice[0]} stands there twice", at=Location(name, 1, 1, text.split("\n", 1)[0])
        )
    rows = []
    for row in reader:
        if any(cell.strip() for cell in row):
            rows.append(_numbers(row, heads, name, reader.line_num))
    if not rows:
        raise ConfigError("CC450", "the table has no rows", at=Location(name, 1, 1))
    values = np.array(rows)
    return {head: values[:, i] for i, head in enumerate(heads)}


def _numbers(row: Sequence[str], heads: Sequence[str], name: str, line: int) -> list[float]:
    source = ",".join(row)
    if len(row) != len(heads):
        at = Location(name, line, 1, source)
        raise ConfigError("CC450", f"{len(row)} cells under {len(heads)} column names", at=at)
    out, column = [], 1
    for cell, head in zip(row, heads, strict=True):
        try:
            out.append(float(cell) if cell.strip() else np.nan)
        except ValueError:
            at = Location(name, line, column, source)
            raise ConfigError("CC450", f"'{cell}' in column {head} is not a number", at=at) from None
        column += len(cell) + 1
    return out
