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

from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location
from camcomp.model.config.robot import PrismaticActuator, RevoluteActuator

USUAL = {
    "t_s": ("t_s", "time_s", "time", "timestamp"),
    "x_mm": ("x_mm", "measurement_x", "x"),
    "y_mm": ("y_mm", "measurement_y", "y"),
    "z_mm": ("z_mm", "measurement_z", "z"),
    "temp_C": ("temp_c", "measurement_temperature", "temperature"),
}
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
    text = data.decode("utf-8-sig", errors="replace")
    lines = [line for line in text.splitlines() if line.strip()]
    if not lines:
        raise ConfigError("CC421", "the table is empty", at=Location(name, 1, 1))
    mark = max(";\t,", key=lines[0].count)
    header = [cell.strip().strip('"') for cell in lines[0].split(mark)]
    lower = [each.lower() for each in header]
    wanted: dict[str, tuple[str, ...]] = {}
    for key, each in actuators.items():
        wanted[f"act_{key}_{'rad' if each.rotary else 'mm'}"] = (key.lower(), f"{key.lower()}_joint")
    wanted |= USUAL
    index: dict[str, int] = {}
    for log, theirs in wanted.items():
        chosen = (columns or {}).get(log)
        names = (log.lower(), *theirs) if chosen is None else (chosen.lower(),)
        found = [i for i, each in enumerate(lower) if each in names]
        if found:
            index[log] = found[0]
        elif log not in ("t_s", "temp_C"):
            hint = f"name it: --column {log}=THEIRS; there are: {', '.join(header)}"
            raise ConfigError("CC421", f"no column for {log}", at=Location(name, 1, 1, lines[0]), hint=hint)
    table = np.empty((len(lines) - 1, len(index)))
    for r, line in enumerate(lines[1:]):
        cells = line.split(mark)
        for c, i in enumerate(index.values()):
            table[r, c] = _number(cells[i] if i < len(cells) else "", mark, Location(name, r + 2, 1, line))
    notes: list[str] = []
    values = dict(zip(index, table.T, strict=True))
    values["t_s"] = _seconds(values.get("t_s"), len(table), notes)
    if rows is not None and rows < len(table):
        keep = np.unique(np.linspace(0, len(table) - 1, rows).round().astype(int))
        values = {key: each[keep] for key, each in values.items()}
        notes.append(f"{len(keep)} of {len(table)} rows")
    order = ["t_s", *(key for key in wanted if key in values and key != "t_s")]
    return Recording(Path(name).stem, _csv({key: values[key] for key in order}), len(values["t_s"]), tuple(notes))


def _number(cell: str, mark: str, at: Location) -> float:
    cell = cell.strip().strip('"')
    if not cell:
        return float("nan")
    try:
        return float(cell.replace(",", ".") if mark != "," else cell)
    except ValueError:
        raise ConfigError("CC422", f"'{cell}' is not a number", at=at) from None


def _seconds(stamps: Floats | None, n: int, notes: list[str]) -> Floats:
    """Seconds since the earliest row: of times in s, or of stamps such as 20200714163904; else the number of the row."""
    if stamps is not None and np.isfinite(stamps).all() and np.unique(stamps).size > 0.5 * n:
        if stamps.min() < 1e12:
            out: Floats = stamps - stamps.min()
            return out
        try:
            seconds = np.array(
                [(datetime.strptime(f"{s:.0f}", "%Y%m%d%H%M%S") - datetime(2000, 1, 1)).total_seconds() for s in stamps]
            )
            told: Floats = seconds - seconds.min()
            return told
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
    values = {
        "t_s": found["t"] - found["t"][0],
        f"cmd_{target}_mm": 1e3 * found["qg"],
        f"act_{target}_mm": 1e3 * found["qm"],
    }
    if "vir" in found and "gtau" in found:
        values[f"act_{target}_N"] = found["vir"] * float(found["gtau"][0])
    if rows is not None:
        values = {key: each[:rows] for key, each in values.items()}
    return Recording(Path(name).stem, _csv(values), len(values["t_s"]))


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
