"""Recordings of others as logs: tables of robot poses, and MATLAB files of one axis.

A pose table may use semicolons and decimal commas, as spreadsheets of half of Europe do. Its columns are found by name:
a joint by the actuator's name, alone or with _joint, and what is measured by the usual names below, or as --column says.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from os.path import relpath
from pathlib import Path
from typing import Any

import numpy as np

from camcomp.ground.csv_table import TableRules, read_csv
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location
from camcomp.model.config.robot import PrismaticActuator, RevoluteActuator
from camcomp.model.motion.log_columns import TEMPERATURE, TIME, TIP, log_columns

USUAL = {  # beside the log's own names
    TIME: ("time_s", "time", "timestamp"),
    **{own: (f"measurement_{axis}", axis) for own, axis in zip(TIP, "xyz", strict=True)},
    TEMPERATURE: ("measurement_temperature", "temperature"),
}
POSE_RULES = TableRules(table="CC421", column="CC421", cell="CC422")
Actuators = Mapping[str, PrismaticActuator | RevoluteActuator]


@dataclass(frozen=True)
class Recording:
    """One run: its name, log as CSV, number of rows, and what the reader should know."""

    name: str
    log: bytes
    rows: int
    notes: tuple[str, ...] = ()


def read_poses(
    data: bytes, name: str, actuators: Actuators, *, columns: Mapping[str, str] | None = None, rows: int | None = None,
    **_: Any,
) -> Recording:  # fmt: skip
    """A table of static poses. Raises ConfigError CC421 for missing columns, CC422 for cells that are no numbers."""
    recorded = read_csv(data, name, POSE_RULES, spreadsheet=True)
    lower = [each.lower() for each in recorded.header]
    encoders = log_columns(list(actuators), [each.rotary for each in actuators.values()]).encoder
    wanted: dict[str, tuple[str, ...]] = {
        log: (key.lower(), f"{key.lower()}_joint") for key, log in zip(actuators, encoders, strict=True)
    }
    wanted |= USUAL
    index: dict[str, int] = {}
    for log, theirs in wanted.items():
        chosen = (columns or {}).get(log)
        names = (log.lower(), *theirs) if chosen is None else (chosen.lower(),)
        found = [i for i, each in enumerate(lower) if each in names]
        if found:
            index[log] = found[0]
        elif log not in (TIME, TEMPERATURE):
            hint = f"name it: --column {log}=THEIRS; there are: {', '.join(recorded.header)}"
            raise ConfigError("CC421", f"no column for {log}", at=recorded.at(-1), hint=hint)
    recorded.refuse_twice(list(index.values()))
    table = recorded.values(list(index.values()))
    notes: list[str] = []
    values = dict(zip(index, table.T, strict=True))
    values[TIME] = _seconds(values.get(TIME), len(table), notes)
    if rows is not None and rows < len(table):
        keep = np.unique(np.linspace(0, len(table) - 1, rows).round().astype(int))
        values = {key: each[keep] for key, each in values.items()}
        notes.append(f"{len(keep)} of {len(table)} rows")
    order = [TIME, *(key for key in wanted if key in values and key != TIME)]
    return Recording(Path(name).stem, _csv({key: values[key] for key in order}), len(values[TIME]), tuple(notes))


def _seconds(stamps: Floats | None, n: int, notes: list[str]) -> Floats:
    """Seconds since the earliest row: of times in s, or of stamps such as 20200714163904; else the number of the row."""
    if stamps is not None and np.isfinite(stamps).all() and np.unique(stamps).size > 0.5 * n:
        if stamps.min() < 1e12:
            return stamps - stamps.min()
        try:
            seconds = np.array(
                [(datetime.strptime(f"{s:.0f}", "%Y%m%d%H%M%S") - datetime(2000, 1, 1)).total_seconds() for s in stamps]
            )
            return seconds - seconds.min()
        except ValueError:
            pass
    notes.append("no usable times, t_s is the number of the row")
    return np.arange(n, dtype=float)


def read_axis(
    data: bytes, name: str, actuators: Actuators, *, actuator: str | None = None, rows: int | None = None, **_: Any
) -> Recording:
    """A MATLAB file of one axis: t s, reference qg m, position qm m, drive signal vir, gtau N per unit of it.

    Raises ConfigError CC423 where something is missing.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        found = {key: np.ravel(value) for key, value in loadmat(io.BytesIO(data)).items() if not key.startswith("__")}
    except (ValueError, TypeError, NotImplementedError, OSError, MatReadError) as error:
        raise ConfigError("CC423", f"not a MATLAB file that can be read: {error}", at=Location(name, 1, 1)) from error
    missing = [key for key in ("t", "qg", "qm") if key not in found]
    if missing:
        there = ", ".join(found) or "nothing"
        raise ConfigError("CC423", f"no variable {', '.join(missing)}; there is {there}", at=Location(name, 1, 1))
    target = actuator or next(iter(actuators))
    if target not in actuators:
        raise ConfigError("CC423", f"the machine has no actuator '{target}'", at=Location(name, 1, 1))
    named = log_columns([target], [False])
    values = {
        TIME: found["t"] - found["t"][0],
        named.setpoint[0]: 1e3 * found["qg"],
        named.encoder[0]: 1e3 * found["qm"],
    }
    if "vir" in found and "gtau" in found:
        values[named.drive[0]] = found["vir"] * float(found["gtau"][0])
    if rows is not None:
        values = {key: each[:rows] for key, each in values.items()}
    return Recording(Path(name).stem, _csv(values), len(values[TIME]))


def _csv(columns: Mapping[str, Floats]) -> bytes:
    table = np.column_stack(list(columns.values()))
    lines = [",".join(columns)]
    lines += [",".join("" if np.isnan(cell) else f"{cell:.9g}" for cell in row) for row in table]
    return ("\n".join(lines) + "\n").encode("ascii")


def experiment_yaml(
    recordings: Sequence[Recording], configs: Sequence[str], folder: Path, holdout: Sequence[str]
) -> bytes:
    """Experiment file in `folder`: every recording is a run in a clamping of its own. Raises ConfigError CC424."""
    names = [each.name for each in recordings]
    for name in [*(n for n in names if names.count(n) > 1), *(h for h in holdout if h not in names)]:
        raise ConfigError("CC424", f"'{name}' is not the name of exactly one file", hint=f"files: {', '.join(names)}")
    lines = ["# Written by camcomp import.", "config:"]
    lines += [f"  - {relpath(each, folder)}" for each in configs]
    lines.append("runs:")
    lines += [f"  - {{name: {n}, log: {n}.csv, cutting: false, clamping: {n}}}" for n in names]
    if holdout:
        lines.append(f"holdout: [{', '.join(holdout)}]")
    return ("\n".join(lines) + "\n").encode()
