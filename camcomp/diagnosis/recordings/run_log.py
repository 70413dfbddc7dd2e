"""The log of one run from a recording: columns assigned and joined, units converted, unusable rows dropped, with notes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from camcomp.diagnosis.recordings.joining import SampledTable, join
from camcomp.diagnosis.recordings.mat_file import OF_AXIS
from camcomp.diagnosis.recordings.naming import (
    Pick,
    Picked,
    check_enough,
    pick_columns,
    unused_column_notes,
    usual_names,
)
from camcomp.diagnosis.recordings.sampled import SampledColumns
from camcomp.diagnosis.recordings.units import seconds
from camcomp.ground.bounds import LARGEST_NUMBER
from camcomp.ground.datatypes import Floats, Ints
from camcomp.ground.errors import ConfigError
from camcomp.model.config.robot import PrismaticActuator, RevoluteActuator
from camcomp.model.motion.log_columns import LINE, TIME, LogColumns, log_columns

Actuators = Mapping[str, PrismaticActuator | RevoluteActuator]


@dataclass(frozen=True)
class Recording:
    """One imported run: name, log as CSV, number of rows, notes."""

    name: str
    log: bytes
    rows: int
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Wishes:
    """Options of the user for recordings.

    columns: the recording's name by the log's; rows: at most; degrees: whether joint angles are in degrees, None: by their
    size; period_s: between rows without times; join: "time", "rows" or None; program: the run has one.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    rows: int | None = None
    degrees: bool | None = None
    period_s: float | None = None
    join: str | None = None
    program: bool = False


def columns_of_axis(sampled: Sequence[SampledColumns], actuators: Actuators, actuator: str | None) -> dict[str, str]:
    """Variables of a recording of one axis by the log's columns of an actuator, the first by default; no names of other recordings.

    Raises ConfigError CC423.
    """
    there = {name for part in sampled for name in part.names}
    if not there.issuperset(OF_AXIS[:2]):
        return {}
    target = actuator or next(iter(actuators))
    if target not in actuators:
        raise ConfigError("CC423", f"the machine has no actuator '{target}'", at=sampled[0].at(-1, 0))
    named = log_columns([target], [actuators[target].rotary])
    logs = (*named.setpoint, *named.encoder, *named.drive)
    return {log: theirs for log, theirs in zip(logs, OF_AXIS, strict=True) if theirs in there}


def log_of(name: str, sampled: Sequence[SampledColumns], actuators: Actuators, wishes: Wishes) -> Recording:
    """The log of a run. Raises ConfigError CC405 (time), CC421 (columns), CC422 (cells), CC453 (parts of a run)."""
    columns = log_columns(list(actuators), [each.rotary for each in actuators.values()])
    picked = pick_columns(sampled, list(actuators), columns, wishes.columns)
    check_enough(sampled, picked, columns, program=wishes.program)
    notes = [note for part in sampled for note in part.notes] + picked.notes
    joined, more = join(_parts(sampled, picked, columns, notes), wishes.join)
    notes += more
    values = _in_rad(_without_dead_encoders(joined.values, columns, notes), columns, picked, wishes.degrees, notes)
    driven = wishes.program or any(log in values for log in columns.setpoint)
    time, keep = _times(joined, driven, wishes.period_s, notes)
    keep = _thinned(keep, wishes.rows, notes)
    notes += unused_column_notes(sampled, picked)
    table = {TIME: time[keep]}
    table |= {log: values[log][keep] for log in usual_names(list(actuators), columns) if log in values and log != TIME}
    empty = {log: int(np.isnan(each).sum()) for log, each in table.items() if np.isnan(each).any()}
    if empty:
        notes.append("empty cells: " + ", ".join(f"{count} in {log}" for log, count in empty.items()))
    return Recording(name, csv_of(table), len(keep), tuple(notes))


def csv_of(columns: Mapping[str, Floats]) -> bytes:
    """A table (n, k) as CSV, NaN as empty cells."""
    lines = [",".join(columns)]
    table = np.column_stack(list(columns.values()))
    lines += [",".join("" if np.isnan(cell) else f"{cell:.9g}" for cell in row) for row in table]
    return ("\n".join(lines) + "\n").encode("ascii")


def _parts(
    sampled: Sequence[SampledColumns], picked: Picked, columns: LogColumns, notes: list[str]
) -> list[SampledTable]:
    """Parts with assigned columns, and their rows that are kept."""
    several = len({each.part for each in picked.columns.values()}) > 1
    parts = []
    for k, source in enumerate(sampled):
        values = {log: _read(source, each) for log, each in picked.columns.items() if each.part == k}
        if not values:
            continue
        pick = picked.times.get(k)
        time = source.time if pick is None else seconds(source.read(pick.column), pick.factor)
        there = np.any([np.isfinite(each) for log, each in values.items() if log != LINE or len(values) == 1], axis=0)
        _say(notes, int((~there).sum()), "rows without values dropped", source)
        if time is not None:
            _say(notes, int((there & ~np.isfinite(time)).sum()), "rows without time dropped", source)
            there &= np.isfinite(time)
        rows = np.flatnonzero(there)
        if not len(rows):
            raise ConfigError("CC422", "no row holds numbers in the columns that count", at=source.at(-1, 0))
        if several and time is not None:
            rows = rows[np.argsort(time[rows], kind="stable")]
        leading = any(log in ("x_mm", *columns.setpoint, *columns.encoder) for log in values)
        kept = {log: each[rows] for log, each in values.items()}
        time = None if time is None else time[rows]
        parts.append(SampledTable(source=source, time=time, values=kept, row=rows, leading=leading))
    return parts


def _read(source: SampledColumns, pick: Pick) -> Floats:
    """Values (n,) in the unit of the log. Raises ConfigError CC422 for other texts and numbers out of bounds."""
    values = source.read(pick.column) * (1.0 if pick.factor is None else pick.factor)
    wild = np.flatnonzero(np.abs(values) > LARGEST_NUMBER)
    if len(wild):
        message = f"{values[wild[0]]:g} in row {wild[0] + 1} of column {source.names[pick.column]} is no value"
        raise ConfigError("CC422", message, at=source.at(int(wild[0]), pick.column))
    return values


def _in_rad(
    values: dict[str, Floats], columns: LogColumns, picked: Picked, degrees: bool | None, notes: list[str]
) -> dict[str, Floats]:
    """Values with joint angles in rad; angles without a stated unit are degrees beyond two turns."""
    angles = [
        log for log in (*columns.setpoint, *columns.encoder, *columns.load)
        if log in values and log.endswith("_rad") and (degrees or picked.columns[log].factor is None)
    ]  # fmt: skip
    if not angles or degrees is False:
        return values
    largest = max(float(np.nanmax(np.abs(values[log]), initial=0.0)) for log in angles)
    if not degrees and largest <= 4.0 * np.pi:
        return values
    why = "--degrees" if degrees else f"they go up to {largest:.4g}; --radians if they are not"
    notes.append(f"joint angles are read as degrees: {why}")
    return values | {log: np.radians(values[log]) for log in angles}


def _without_dead_encoders(values: dict[str, Floats], columns: LogColumns, notes: list[str]) -> dict[str, Floats]:
    """Values without second encoders that are constant while the motor moves: recorders write 0 for missing encoders."""
    dead = [
        load
        for load, act in zip(columns.load, columns.encoder, strict=True)
        if load in values and not np.nanstd(values[load]) and np.nanstd(values.get(act, values[load]))
    ]
    if dead:
        notes.append(f"second encoders that never move dropped: {', '.join(dead)}")
    return {name: each for name, each in values.items() if name not in dead}


def _times(joined: SampledTable, driven: bool, period_s: float | None, notes: list[str]) -> tuple[Floats, Ints]:
    """Seconds since the earliest row (n,), and the rows that are kept. Raises ConfigError CC405 for decreasing times."""
    row, n = joined.row, len(joined.row)
    if joined.time is None:
        if period_s is None:
            so = ": speeds and lags are per row, unless --period-s says how far rows are apart" if driven else ""
            notes.append(f"no usable times, t_s is the number of the row{so}")
        else:
            notes.append(f"no usable times, rows are {period_s:g} s apart (--period-s)")
        return (row - row[0]) * (1.0 if period_s is None else period_s), np.arange(n)
    time = joined.time - joined.time.min()
    keep = np.arange(n)
    if driven:
        keep = np.flatnonzero(np.concatenate(([True], np.diff(time) != 0.0)))
        _say(notes, n - len(keep), "rows of a time that was there before dropped", joined.source)
        back = np.flatnonzero(np.diff(time[keep]) < 0.0)
        if len(back):
            first, second = time[keep[back[0] : back[0] + 2]]
            message = f"time goes back by {first - second:g} s"
            raise ConfigError("CC405", message, at=joined.source.at(int(row[keep[back[0] + 1]]), 0))
    return time, keep


def _thinned(keep: Ints, rows: int | None, notes: list[str]) -> Ints:
    if rows is None or rows >= len(keep):
        return keep
    some = keep[np.unique(np.linspace(0, len(keep) - 1, rows).round().astype(int))]
    notes.append(f"{len(some)} of {len(keep)} rows (--rows), {len(keep) - len(some)} dropped")
    return np.asarray(some, np.int64)


def _say(notes: list[str], count: int, what: str, source: SampledColumns) -> None:
    if count:
        notes.append(f"{count} {what} ({source.file})")
