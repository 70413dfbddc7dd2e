"""Reader of TwinCAT Scope's text export: a block about the recording, one about its channels, then times and values.

In the block about the channels, a column with the name `Name` has the times of the columns right of it.
"""

from __future__ import annotations

import csv

import numpy as np

from camcomp.diagnosis.recordings.sampled import SampledColumns
from camcomp.diagnosis.recordings.tables import TABLE_RULES, of_table
from camcomp.ground.csv_table import CsvTable, read_csv
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location

_CHANNELS, _UNIT = "Name", "Unit"
_OF_CHANNELS = ("SymbolName", "SampleTime[ms]", "Data-Type")


def is_scope_text(data: bytes) -> bool:
    """Whether a text has the first lines of the export."""
    start = data[:100_000].removeprefix(b"\xef\xbb\xbf")
    return start.startswith(_CHANNELS.encode()) and any(b"\n" + each.encode() in start for each in _OF_CHANNELS)


def read_scope(data: bytes, name: str) -> list[SampledColumns]:
    """Channels by their times. Raises ConfigError CC452 (no block on channels, no times), CC421, CC422."""
    text = data.decode("utf-8", errors="replace").removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")
    mark = lines[0][len(_CHANNELS) : len(_CHANNELS) + 1]
    heads = [i for i, line in enumerate(lines) if line.split(mark or None, 1)[:1] == [_CHANNELS]]
    if mark not in tuple("\t;,") or len(heads) < 2:
        hint = "export it with its header and with time columns"
        message = "the export of TwinCAT Scope names no channels with times"
        raise ConfigError("CC452", message, at=Location(name, 1, 1), hint=hint)
    head, units = heads[1], list[str]()
    for i, line in enumerate(lines):
        label = line.split(mark, 1)[0].strip()
        if label == _UNIT and i > head:
            units = next(csv.reader([line], delimiter=mark))
        if i != head and label and not (label[0] in "+-.," or label[0].isdigit()):
            lines[i] = ""
    table = read_csv("\n".join(lines), name, TABLE_RULES, spreadsheet=True)
    timed: dict[int, list[int]] = {}
    for j, label in enumerate(table.header):
        if label == _CHANNELS:
            timed[j] = []
        elif label:
            timed[max(timed)].append(j)
    of_columns = [_unit(units, k) for k in range(len(table.header))]
    return [of_table(table, columns, _times(table, j), of_columns) for j, columns in timed.items() if columns]


def _times(table: CsvTable, column: int) -> Floats:
    """Times (n,) s of one column: beyond 1e15 in steps of 100 ns since 1601, else in ms."""
    times = table.values([column])[:, 0]
    scale = 1e-7 if np.isfinite(times).any() and np.nanmax(times) > 1e15 else 1e-3
    return np.asarray(times * scale, float)


def _unit(units: list[str], column: int) -> str:
    """`mm (Length)` to mm."""
    cell = units[column] if column < len(units) else ""
    return "" if cell.startswith("(") else cell.split("(")[0].strip()
