"""Experiments whose runs have no program: which study they are for, and their logs as that study wants them.

Static poses of an arm (encoders and measured tips, no set-points) and logs of axes (set-points, encoders, drive forces,
no tips) have studies of their own. Everything else goes to the general diagnosis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from camcomp.diagnosis.arm.plausible import check_poses
from camcomp.diagnosis.arm.poses import Poses, approached
from camcomp.diagnosis.arm.study import bench_of
from camcomp.diagnosis.arm.study import studied as study_arm
from camcomp.diagnosis.axis.findings import AxisRun, lever_mm
from camcomp.diagnosis.axis.plausible import check_axes
from camcomp.diagnosis.axis.study import studied as study_axes
from camcomp.diagnosis.axis.surroundings import AxisSurroundings
from camcomp.diagnosis.experiment.log_checks import check_clock
from camcomp.diagnosis.experiment.open_experiment import open_log, read_log, unread
from camcomp.diagnosis.fit.measured import Measured
from camcomp.diagnosis.model.noise import StatedDeviation
from camcomp.diagnosis.residuals import Columns, of_axes, of_poses
from camcomp.diagnosis.result.types import DiagnosisResult
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location
from camcomp.ground.files import display_name
from camcomp.model.config.load import ExperimentFile, read_experiment
from camcomp.model.config.spec import Config, RunSpec
from camcomp.model.effect import Cause
from camcomp.model.motion.log_columns import log_columns
from camcomp.model.statics.arm import arm_of
from camcomp.model.statics.build import build_robot
from camcomp.model.statics.description import Robot
from camcomp.model.statics.masses import has_moved_mass


@dataclass(frozen=True, eq=False)
class LogStudy:
    """The result of logs without programs.

    residuals: what it leaves, row by row (`camcomp.diagnosis.residuals`); notes: what the reader should know of the logs.
    """

    result: DiagnosisResult
    residuals: Callable[[], Columns]
    notes: tuple[str, ...] = ()


def study_of(file: str | Path | ExperimentFile, without: Sequence[str] = ()) -> LogStudy | None:
    """The study of an experiment without programs: static poses or axis logs; None for the general diagnosis.

    Raises ConfigError CC420 where the logs say too little, CC407, CC408, CC412, CC413 where they cannot be of this machine
    as they are read.
    """
    opened = open_logs(read_experiment(file))
    logs, robot, sd, holdout = opened.logs, opened.robot, opened.file.experiment.sd, opened.file.experiment.holdout
    stated = StatedDeviation(**{f.name: getattr(sd, f.name) for f in fields(StatedDeviation)}) if sd else None
    try:
        if all(m.has("tip") and m.has("encoder") and not m.has("setpoint") for m in logs):
            if arm_of(robot) is None:
                return None
            runs = checked_poses(opened)
            own, origin = _causes(opened.file.config), np.array(opened.file.config.workpiece.origin_mm, float)
            result, notes = study_arm(robot, own, runs, holdout=holdout, without=without, stated=stated, origin=origin)
            bench = partial(bench_of, robot, tuple(own), runs, holdout=holdout, origin=origin)
            return LogStudy(result, partial(of_poses, bench, result), (*opened.notes, *notes))
        if not any(m.has("tip") for m in logs) and all(m.has("encoder") for m in logs):
            axes = checked_axes(opened)
            result, found = study_axes(axes, holdout=holdout, without=without, stated=stated, robot=robot)
            by_axis = {a.name: a.revolute for a in robot.actuators}
            return LogStudy(result, partial(of_axes, found, by_axis), (*opened.notes, *_without_masses(opened)))
    except ValidationError:  # a ValueError too, and a fault of ours
        raise
    except ValueError as error:
        singular = "the rows do not determine the fit: some columns do not move, or repeat others"
        message = f"{singular if isinstance(error, np.linalg.LinAlgError) else error}; {_channels_there(opened)}"
        raise ConfigError("CC420", message, at=Location(display_name(opened.file.path), 1, 1)) from error
    return None


def _without_masses(opened: OpenedLogs) -> tuple[str, ...]:
    """Note for the reader where torques or second encoders of an arm show weight and the machine file states no
    mass.
    """
    hinges = [k for k, a in enumerate(opened.robot.actuators) if a.revolute]
    seen = any(np.isfinite(getattr(m, part)[:, hinges]).any() for m in opened.logs for part in ("drive", "load"))
    if not seen or arm_of(opened.robot) is None or has_moved_mass(opened.robot):
        return ()
    return (
        "no mass_kg in the machine file: weight is fitted by angle, and drives that give way under it are not found",
    )


def _channels_there(opened: OpenedLogs) -> str:
    """The channels that the logs hold, with their actuators and the rows of the longest, for a message."""
    actuators = [a.name for a in opened.robot.actuators]
    parts = []
    for channel, text in (("setpoint", "set-points"), ("encoder", "encoders"), ("drive", "drive forces or torques")):
        rows = np.max([np.isfinite(getattr(each, channel)).sum(axis=0) for each in opened.logs], axis=0)
        named = [name for name, count in zip(actuators, rows, strict=True) if count]
        if named:
            parts.append(f"{text} of {', '.join(named)} (at most {int(rows.max())} rows)")
    return f"the logs hold {'; '.join(parts)}" if parts else "the logs hold no column of an actuator"


@dataclass(frozen=True, eq=False)
class OpenedLogs:
    """An experiment whose runs have no program: its files, a log per run, and notes for the reader."""

    file: ExperimentFile
    robot: Robot
    logs: list[Measured]
    notes: list[str]


def open_logs(file: ExperimentFile) -> OpenedLogs:
    """The logs of an experiment without programs."""
    experiment, config = file.experiment, file.config
    robot, _ = build_robot(config.robot, config.tool.tip)
    columns = log_columns([a.name for a in robot.actuators], [a.revolute for a in robot.actuators])
    tables = [open_log(run.log) for run in experiment.runs]
    notes = [note for table in tables for note in unread(table, columns)]
    return OpenedLogs(file, robot, [read_log(table, columns) for table in tables], notes)


def checked_axes(opened: OpenedLogs) -> dict[str, list[AxisRun]]:
    """Runs of every axis by name, of logs without a tip. Raises ConfigError CC407, CC408."""
    robot, causes = opened.robot, _causes(opened.file.config)
    runs = list(zip(opened.file.experiment.runs, opened.logs, strict=True))
    for run, log in runs:
        check_clock(display_name(run.log), log)
    axes = {a.name: [_axis(run, log, k, a.revolute) for run, log in runs] for k, a in enumerate(robot.actuators)}
    around, logs = AxisSurroundings(robot, axes), opened.logs
    axes = {
        name: [around.without_effects(name, one, causes, log) for one, log in zip(own, logs, strict=True)]
        for name, own in axes.items()
    }
    for i, (run, _) in enumerate(runs):
        check_axes(display_name(run.log), {name: own[i] for name, own in axes.items()}, run.cutting)
    return axes


def checked_poses(opened: OpenedLogs) -> list[Poses]:
    """Static poses of every run. Raises ConfigError CC407, CC408, CC412, CC413."""
    runs = [_poses(run, log) for run, log in zip(opened.file.experiment.runs, opened.logs, strict=True)]
    for run, each in zip(opened.file.experiment.runs, runs, strict=True):
        opened.notes.extend(check_poses(display_name(run.log), run.name, opened.robot, each.q, each.tip))
    return runs


def _causes(config: Config) -> list[Cause]:
    return [
        Cause(each.effect, shelf.load("effects", each.effect), each.target, dict(each.values))
        for each in config.effects
    ]


def _poses(run: RunSpec, log: Measured) -> Poses:
    """Rows with every joint and the whole tip."""
    known = np.flatnonzero(np.isfinite(np.concatenate((log.encoder, log.tip), axis=1)).all(axis=1))
    heat = _filled(log.time, log.temperature)
    label = "common" if run.clamping is None else str(run.clamping)
    n = len(log.time)
    columns = [_filled(log.time, own) for own in log.tip_sd.T]
    stated = [own for own in columns if own is not None]
    sd = np.stack(stated, axis=1) if len(stated) == len(columns) else log.tip_sd if stated else None
    every = Poses(
        label=label,
        q=log.encoder,
        tip=log.tip,
        time=run.started_s + log.time,
        temperature=heat,
        run=np.full(n, run.name),
        sd=sd,
        row=np.arange(1, n + 1),
        torque=log.drive if log.has("drive") else None,
        force=log.force() if log.has("dyno") else None,
    ).take(known)
    return replace(every, approach=approached(every.q, every.time))


def _filled(time: Floats, values: Floats) -> Floats | None:
    """A logged channel (n,) with its empty cells interpolated in time; None where at most half of its cells are
    known.
    """
    known = np.isfinite(values)
    if known.mean() <= 0.5:
        return None
    order = np.flatnonzero(known)[np.argsort(time[known], kind="stable")]
    return np.where(known, values, np.interp(time, time[order], values[order]))


def _axis(run: RunSpec, log: Measured, k: int, revolute: bool) -> AxisRun:
    """Rows, one per time and in its order, with all that the log has of this axis; ways and torques of hinges at the end of their arm."""
    lever = lever_mm(revolute)
    channels = (lever * log.encoder[:, k], lever * log.setpoint[:, k], log.drive[:, k] / lever, lever * log.load[:, k])
    known = np.isfinite(log.encoder[:, k])
    for each in channels:
        if np.isfinite(each).mean() > 0.5:
            known &= np.isfinite(each)
    rows = np.flatnonzero(known)
    rows = rows[np.unique(log.time[rows], return_index=True)[1]]
    encoder, setpoint, force, load = (each[rows] for each in channels)
    return AxisRun(
        name=run.name, time=log.time[rows], setpoint=setpoint, encoder=encoder, force=force, row=rows + 1,
        revolute=revolute, started=run.started_s, load=load if np.isfinite(load).all() else None,
    )  # fmt: skip
