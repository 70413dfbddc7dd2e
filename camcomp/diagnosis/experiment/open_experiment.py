"""Opening of an experiment file: logs and programs as runs, with checks."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path as FilePath

import numpy as np
from scipy.signal import savgol_filter

from camcomp.diagnosis.experiment.driven_run import drive
from camcomp.diagnosis.experiment.log_checks import (
    check_channels,
    check_clock,
    check_length,
    check_rows,
)
from camcomp.diagnosis.experiment.logged import Logged
from camcomp.diagnosis.fit.bench import MOST_ROWS, Run
from camcomp.diagnosis.fit.labels import with_clocks
from camcomp.diagnosis.fit.measured import Measured
from camcomp.ground.csv_table import CsvTable, TableRules, read_csv
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError
from camcomp.ground.files import display_name, read_bytes
from camcomp.ground.progress import steps
from camcomp.model.config.load import ExperimentFile, read_experiment
from camcomp.model.config.spec import Config, Experiment, RunSpec
from camcomp.model.control import open_program
from camcomp.model.from_program import job_of_program
from camcomp.model.job import Job
from camcomp.model.motion.log_columns import DYNO, LINE, TEMPERATURE, TIME, TIP, TIP_SD, LogColumns, log_columns
from camcomp.model.motion.timeline import schedule
from camcomp.model.motion.twin import Twin, twin_of

STEADY_S = 15.0  # half width of the local regression of a temperature
LOG_RULES = TableRules(table="CC400", column="CC401", cell="CC403")


@dataclass(frozen=True, eq=False)
class OpenExperiment:
    """An opened experiment. notes: remarks on the logs."""

    experiment: Experiment
    job: Job
    twin: Twin
    runs: tuple[Run, ...]
    notes: tuple[str, ...]


def open_experiment(file: str | FilePath | ExperimentFile) -> OpenExperiment:
    """Open an experiment file with all its files. Raises ConfigError, ProgramError, FileError, PhysicsError."""
    file = read_experiment(file)
    experiment, job = file.experiment, Job(file.config)
    twin = twin_of(job)
    notes: list[str] = []
    runs = [open_run(spec, job, twin, notes) for spec in steps(experiment.runs, len(experiment.runs))]
    order = sorted(range(len(runs)), key=lambda k: experiment.runs[k].started_s)
    worn = 0.0
    for k in order:
        runs[k] = replace(runs[k], run_path=replace(runs[k].run_path, cut_before_min=worn))
        worn += runs[k].run_path.cut_ahead_min + runs[k].run_path.cut_min
    return OpenExperiment(experiment, job, twin, tuple(with_clocks(twin, runs)), tuple(notes))


def open_run(spec: RunSpec, job: Job, twin: Twin, notes: list[str]) -> Run:
    """One run of an experiment."""
    table, log = open_log(spec.log), display_name(spec.log)
    measured = read_log(table, columns_of(twin))
    check_clock(log, measured)
    measured = in_time(measured)
    notes += unread(table, columns_of(twin))
    check_rows(log, measured)
    program = None if spec.program is None else open_program(spec.program, job.config)
    cutting = job if program is None else job_of_program(job, program.data, program.name)
    conditions = cutting.conditions if spec.cutting else replace(job.conditions, model=None)
    logged = Logged(
        file=log, run=spec.name, measured=measured, twin=twin, started=spec.started_s,
        temperature=steadied(measured.time, measured.temperature),
        acceleration=job.config.control.acceleration_mm_per_s2,
    )  # fmt: skip
    if program is not None:
        check_length(logged, schedule(program.path, logged.acceleration).end)
    run = drive(logged, program, conditions)
    if run.lag:
        notes.append(f"{log}: line numbers are {abs(run.lag)} rows {'late' if run.lag > 0 else 'early'}")
    if run.by == "setpoint":  # encoders are evidence only against set-points
        measured = replace(measured, encoder=np.where(run.guessed, np.nan, measured.encoder))
    thin = int(np.ceil(len(measured.time) / MOST_ROWS))
    if run.run_path.measured_force:  # the dynamometer is the force itself
        measured = replace(measured, dyno=np.full_like(measured.dyno, np.nan))
    return Run(
        name=spec.name,
        run_path=replace(run.run_path, measured_force=run.run_path.measured_force or job.has_measured_force),
        measured=measured, clamping=spec.clamping, clock=spec.clock, thin=thin, by=run.by, unsure=run.unsure,
        turn=run.turn, program=None if program is None else program.path,
    )  # fmt: skip


def in_time(measured: Measured) -> Measured:
    """The rows in the order of their times without repetitions: loggers write some rows late or twice."""
    order = np.argsort(measured.time, kind="stable")
    measured = measured.take(order) if (np.diff(order) < 0).any() else measured
    again = np.zeros(len(measured.time), bool)
    for i in np.flatnonzero(np.diff(measured.time) == 0) + 1:
        again[i] = all(
            np.array_equal(getattr(measured, n)[i], getattr(measured, n)[i - 1], equal_nan=True)
            for n in measured.__dataclass_fields__
        )
    return measured.take(~again) if again.any() else measured


def steadied(time: Floats, values: Floats) -> Floats | None:
    """Temperatures (n,) smoothed by local linear regression, because a growth would turn sensor noise into motion.

    Machines warm within minutes, so that half a minute (at most a quarter of the run) is linear.
    """
    known = np.isfinite(values)
    if not known.any():
        return None
    every = np.interp(time, time[known], values[known])
    n = len(time)
    step = float(np.median(np.diff(time))) if n > 1 else 0.0
    reach = int(min(STEADY_S / step if step > 0 else 0.0, n / 8))
    return every if reach < 2 else np.asarray(savgol_filter(every, 2 * reach + 1, 1), float)


def unread(table: CsvTable, columns: LogColumns) -> list[str]:
    """Notes on unknown columns of a log, each with the nearest known name."""
    lower = {name.lower(): name for name in columns.known}
    out = []
    for each in table.header:
        if each and each not in columns.known:
            close = (
                get_close_matches(each.lower(), lower, n=1)
                or [n for n in lower if n.startswith(f"{each.lower()}_")][:1]
            )
            meant = f"; did you mean {lower[close[0]]}?" if close and lower[close[0]] not in table.header else ""
            out.append(f"{table.name}: column {each} is not read{meant}")
    return out


def columns_of(twin: Twin) -> LogColumns:
    """Names of the columns of this machine's logs."""
    return log_columns(twin.actuators, [a.revolute for a in twin.robot.actuators])


def check_log(path: str, config: Config | None) -> None:
    """Raise the errors of a log on its own: no table, no times, invalid cells; with a config also of its columns.

    Raises ConfigError CC400, CC401, CC403, CC404, CC405, FileError.
    """
    table = open_log(path)
    if config is not None:
        actuators = config.robot.actuators
        measured = read_log(table, log_columns(list(actuators), [each.rotary for each in actuators.values()]))
        check_channels(table.name, measured)
        check_clock(table.name, measured)


def open_log(path: str) -> CsvTable:
    """Table of a log file. Raises ConfigError CC400 (not a table), CC401 (column), CC403 (cell), FileError."""
    table = read_csv(read_bytes(path), display_name(path), LOG_RULES)
    table.refuse_twice()
    return table


def read_log(table: CsvTable, columns: LogColumns) -> Measured:
    """Measurements of a log. Raises ConfigError CC401 (column), CC403 (cell)."""
    every = table.values()

    def column(label: str) -> Floats:
        return every[:, table.header.index(label)] if label in table.header else np.full(len(every), np.nan)

    def group(labels: Sequence[str]) -> Floats:
        return np.column_stack([column(each) for each in labels])

    time = column(TIME)
    if not np.isfinite(time).all():
        row = int(np.argmin(np.isfinite(time))) if TIME in table.header else -1
        raise ConfigError(
            "CC401",
            f"the log needs a column {TIME} with a number in every row",
            at=table.at(row, table.header.index(TIME) if TIME in table.header else 0),
        )
    return Measured(
        time=time, line=column(LINE), tip=group(TIP), setpoint=group(columns.setpoint),
        encoder=group(columns.encoder), drive=group(columns.drive), load=group(columns.load), dyno=group(DYNO),
        temperature=column(TEMPERATURE), tip_sd=group(TIP_SD),
    )  # fmt: skip
