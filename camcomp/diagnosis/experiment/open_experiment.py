"""Experiment files and logs to runs on the bench: what is read is checked, what does not fit is refused with a reason."""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path as FilePath

import numpy as np

from camcomp.diagnosis.experiment.driven_run import drive
from camcomp.diagnosis.experiment.log_checks import (
    check_length,
    check_rows,
)
from camcomp.diagnosis.fit.bench import Run
from camcomp.diagnosis.fit.measured import Measured
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location
from camcomp.ground.files import display_name, read_bytes
from camcomp.model.config.load import load_config, load_experiment
from camcomp.model.config.spec import Experiment, RunSpec
from camcomp.model.control import open_program
from camcomp.model.job import Job
from camcomp.model.motion.timeline import schedule
from camcomp.model.motion.twin import Twin, twin_of

STEADY_S = 15.0  # half the width of a temperature's local straight line
MOST_ROWS = 3000  # rows of a run beyond which neighbours are averaged


@dataclass(frozen=True, eq=False)
class OpenExperiment:
    """An experiment ready for the bench. notes: what the reader should know about the logs."""

    experiment: Experiment
    job: Job
    twin: Twin
    runs: tuple[Run, ...]
    notes: tuple[str, ...]


def open_experiment(path: str | FilePath) -> OpenExperiment:
    """Reads an experiment file with everything it names. Raises ConfigError, ProgramError, FileError, PhysicsError."""
    experiment = load_experiment(path)
    config = load_config(experiment.config)
    job = Job(config)
    twin = twin_of(job)
    notes: list[str] = []
    runs = [open_run(spec, job, twin, notes) for spec in experiment.runs]
    order = sorted(range(len(runs)), key=lambda k: experiment.runs[k].started_s)
    worn = 0.0
    for k in order:
        runs[k] = replace(runs[k], run_path=replace(runs[k].run_path, cut_before_min=worn))
        worn += runs[k].run_path.cut_min
    return OpenExperiment(experiment, job, twin, tuple(runs), tuple(notes))


def open_run(spec: RunSpec, job: Job, twin: Twin, notes: list[str]) -> Run:
    """One run of an experiment."""
    measured, log = read_log(spec.log, twin), display_name(spec.log)
    notes += unread(spec.log, twin)
    check_rows(log, measured)
    conditions = job.conditions if spec.cutting else replace(job.conditions, model=None)
    path = None if spec.program is None else open_program(spec.program, job.config).path
    if path is not None:
        check_length(log, spec.name, measured, schedule(path, job.config.control.acceleration_mm_per_s2).end)
    run = drive(
        log, spec.name, measured, path, conditions, twin, spec.started_s, job.frame.vectors,
        steadied(measured.time, measured.temperature),
    )  # fmt: skip
    if run.lag:
        notes.append(f"{log}: line numbers are {abs(run.lag)} rows {'late' if run.lag > 0 else 'early'}")
    thin = int(np.ceil(len(measured.time) / MOST_ROWS))
    return Run(
        spec.name, run.run_path, measured, spec.clamping, spec.clock, thin, by=run.by, unsure=run.unsure, turn=run.turn
    )


def steadied(time: Floats, values: Floats) -> Floats | None:
    """Temperatures (n,) without the noise of their sensor, which a growth would turn into motion: local straight lines.

    Machines warm in minutes, so half a minute (and no more than a quarter of the run) is straight.
    """
    known = np.isfinite(values)
    if not known.any():
        return None
    every = np.interp(time, time[known], values[known])
    n = len(time)
    step = float(np.median(np.diff(time))) if n > 1 else 0.0
    reach = int(min(STEADY_S / step if step > 0 else 0.0, n / 8))
    if reach < 2:
        return every
    near = np.arange(-reach, reach + 1)
    weight = 1.0 - (near / (reach + 1.0)) ** 2
    sums = [np.convolve(np.ones(n), (weight * near**k)[::-1], "same") for k in range(3)]
    first, second = (np.convolve(every, (weight * near**k)[::-1], "same") for k in range(2))
    return np.asarray((sums[2] * first - sums[1] * second) / (sums[2] * sums[0] - sums[1] ** 2), float)


def unread(path: str, twin: Twin) -> list[str]:
    """Notes on columns of a log that are not read, each with the name that may have been meant."""
    header = [
        cell.strip() for cell in read_bytes(path).decode("utf-8-sig", errors="replace").split("\n", 1)[0].split(",")
    ]
    known = ["t_s", "line", "x_mm", "y_mm", "z_mm", "fx_N", "fy_N", "fz_N", "temp_C"]
    for a in twin.robot.actuators:
        length, effort = ("rad", "Nmm") if a.revolute else ("mm", "N")
        known += [f"cmd_{a.name}_{length}", f"act_{a.name}_{length}", f"act_{a.name}_{effort}"]
    lower = {name.lower(): name for name in known}
    out = []
    for each in header:
        if each and each not in known:
            close = (
                get_close_matches(each.lower(), lower, n=1)
                or [n for n in lower if n.startswith(f"{each.lower()}_")][:1]
            )
            meant = f"; did you mean {lower[close[0]]}?" if close and lower[close[0]] not in header else ""
            out.append(f"{display_name(path)}: column {each} is not read{meant}")
    return out


def _table(name: str, text: str) -> tuple[list[str], Floats]:
    """Column names and numbers of a CSV text, NaN where a cell is empty. Raises ConfigError CC400, CC401, CC403."""
    try:
        rows = [
            (at, row) for at, row in enumerate(csv.reader(io.StringIO(text)), 1) if any(cell.strip() for cell in row)
        ]
    except csv.Error as error:
        raise ConfigError("CC400", f"the log is no table: {error}", at=Location(name, 1, 1)) from error
    if len(rows) < 2:
        raise ConfigError("CC400", "the log has no rows", at=Location(name, 1, 1))
    header = [cell.strip() for cell in rows[0][1]]
    if len(header) == 1 and ";" in header[0]:
        raise ConfigError(
            "CC400", "cells are separated by commas, not by semicolons", at=Location(name, 1, 1, header[0])
        )
    if twice := next((each for each in header if each and header.count(each) > 1), None):
        at = 1 + sum(len(each) + 1 for each in rows[0][1][: header.index(twice, header.index(twice) + 1)])
        raise ConfigError("CC401", f"column {twice} is there twice", at=Location(name, 1, at, ",".join(rows[0][1])))
    table = np.full((len(rows) - 1, len(header)), np.nan)
    for i, (line, row) in enumerate(rows[1:]):
        for j, cell in enumerate(row):
            if not cell.strip():
                continue
            at = 1 + sum(len(each) + 1 for each in row[:j])
            if j >= len(header):
                message = f"the row has {len(row)} cells and the header {len(header)}"
                raise ConfigError("CC403", message, at=Location(name, line, at, ",".join(row)))
            try:
                table[i, j] = float(cell)
                if np.isinf(table[i, j]):
                    raise ValueError
            except ValueError:
                message = f"'{cell}' in column {header[j]} is not a number"
                raise ConfigError("CC403", message, at=Location(name, line, at, ",".join(row))) from None
    return header, table


def read_log(path: str, twin: Twin) -> Measured:
    """A log CSV. Raises ConfigError CC400 (not a table), CC401 (column), CC403 (cell)."""
    name = display_name(path)
    header, table = _table(name, read_bytes(path).decode("utf-8-sig", errors="replace"))

    def column(label: str) -> Floats:
        return table[:, header.index(label)] if label in header else np.full(len(table), np.nan)

    def group(labels: Sequence[str]) -> Floats:
        return np.column_stack([column(each) for each in labels])

    units = ["rad" if a.revolute else "mm" for a in twin.robot.actuators]
    efforts = ["Nmm" if a.revolute else "N" for a in twin.robot.actuators]
    names = twin.actuators
    time = column("t_s")
    if not np.isfinite(time).all():
        row = int(np.argmin(np.isfinite(time))) + 2 if "t_s" in header else 1
        raise ConfigError("CC401", "the log needs a column t_s with a number in every row", at=Location(name, row, 1))
    return Measured(
        time,
        column("line"),
        group(["x_mm", "y_mm", "z_mm"]),
        group([f"cmd_{a}_{u}" for a, u in zip(names, units, strict=True)]),
        group([f"act_{a}_{u}" for a, u in zip(names, units, strict=True)]),
        group([f"act_{a}_{u}" for a, u in zip(names, efforts, strict=True)]),
        group(["fx_N", "fy_N", "fz_N"]),
        column("temp_C"),
    )
