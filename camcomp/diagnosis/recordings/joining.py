"""Parts of one run on common rows: files of several instruments, topics of one container.

Parts with overlapping times are interpolated; two files with equally many rows are joined row by row, because the machine
stands still while poses are measured one after the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.recordings.sampled import SampledColumns
from camcomp.ground.datatypes import Floats, Ints
from camcomp.ground.errors import ConfigError, Location
from camcomp.model.motion.log_columns import LINE

POSES_S = 0.5  # rows farther apart are poses, without interpolation
_GAP = 5.0  # times the median step: longer steps are not interpolated


@dataclass(frozen=True, eq=False)
class SampledTable:
    """Columns of a log sampled together: time (n,) s ascending or None, values (n,) by name, row (n,) of each in the source.

    leading: has positions or coordinates; other parts are interpolated to its rows.
    """

    source: SampledColumns
    time: Floats | None
    values: dict[str, Floats]
    row: Ints
    leading: bool

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.row)


def join(parts: Sequence[SampledTable], by: str | None) -> tuple[SampledTable, tuple[str, ...]]:
    """Join parts on common rows, those of the leading part, with notes.

    by: "time", "rows" or None for the first possible one. Raises ConfigError CC453.
    """
    if len(parts) == 1:
        return parts[0], ()
    files = {part.source.file for part in parts}
    alike = len({part.rows for part in parts}) == 1
    if by == "rows" or (by is None and len(files) == len(parts) and alike):
        if not alike:
            _refuse(parts, f"{' and '.join(str(part.rows) for part in parts)} rows cannot be joined row by row")
        time = next((part.time for part in parts if part.time is not None), None)
        values = {name: each for part in parts for name, each in part.values.items()}
        return replace(parts[0], time=time, values=values), (f"joined row by row: {_files(parts)}",)
    return _on_time(parts)


def _on_time(parts: Sequence[SampledTable]) -> tuple[SampledTable, tuple[str, ...]]:
    times = [part.time for part in parts if part.time is not None]
    if len(times) < len(parts):
        _refuse(parts, "the parts have neither times nor equally many rows")
    start, end = max(t[0] for t in times), min(t[-1] for t in times)
    if end - start < 0.5 * min(t[-1] - t[0] for t in times):
        _refuse(parts, "the times of the parts have too little in common")
    within = [int(((t >= start) & (t <= end)).sum()) for t in times]
    candidates = [k for k, part in enumerate(parts) if part.leading] or list(range(len(parts)))
    lead = min(candidates, key=lambda k: within[k])
    base = times[lead]
    row = np.flatnonzero((base >= start) & (base <= end))
    poses = max(_step(t) for t in times) >= POSES_S
    values, met = {name: each[row] for name, each in parts[lead].values.items()}, np.ones(len(row), bool)
    for k, part in enumerate(parts):
        if k == lead:
            continue
        near = _nearest(times[k], base[row])
        close = np.abs(times[k][near] - base[row]) <= 0.5 * max(_step(times[k]), _step(base))
        for name, each in part.values.items():
            values[name] = each[near] if poses else _between(times[k], each, base[row], name == LINE)
        met &= close | (not poses)
    values, row = {name: each[met] for name, each in values.items()}, row[met]
    if not len(row):
        _refuse(parts, "no rows of the parts belong to the same time")
    how = "nearest in time" if poses else "on time"
    note = f"joined {how}, on the rows of {parts[lead].source.file}: {_files(parts)}"
    lost = parts[lead].rows - len(row)
    notes = (note, f"{lost} rows outside the common time dropped") if lost else (note,)
    return replace(parts[lead], time=base[row], values=values, row=parts[lead].row[row]), notes


def _step(time: Floats) -> float:
    return float(np.median(np.diff(time))) if len(time) > 1 else 0.0


def _nearest(time: Floats, wanted: Floats) -> Ints:
    return np.ceil(np.interp(wanted, time, np.arange(len(time))) - 0.5).astype(np.int64)


def _between(time: Floats, values: Floats, wanted: Floats, held: bool) -> Floats:
    """Values at other times: linear between rows, or the last one with `held`; NaN in gaps."""
    known = np.isfinite(values)
    if not known.any():
        return np.full(len(wanted), np.nan)
    t, v = time[known], values[known]
    after = np.clip(np.searchsorted(t, wanted), 0, len(t) - 1)
    before = np.clip(np.searchsorted(t, wanted, side="right") - 1, 0, len(t) - 1)
    out = v[before] if held else np.interp(wanted, t, v)
    wide = (t[after] - t[before] > _GAP * _step(time)) | (wanted < t[0]) | (wanted > t[-1])
    return np.where(wide, np.nan, out)


def _files(parts: Sequence[SampledTable]) -> str:
    return ", ".join(dict.fromkeys(part.source.file for part in parts))


def _refuse(parts: Sequence[SampledTable], message: str) -> None:
    raise ConfigError("CC453", f"{message}: {_files(parts)}", at=Location(parts[-1].source.file, 1, 1))
