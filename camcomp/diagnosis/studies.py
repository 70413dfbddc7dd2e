"""Experiments whose runs have no program: which study they are for, and their logs as that study wants them.

Static poses of an arm (encoders and measured tips, no set-points) and logs of axes (set-points, encoders, drive forces,
no tips) have studies of their own. Everything else goes to the general diagnosis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from camcomp.diagnosis.arm.noise_floor import StatedDeviation
from camcomp.diagnosis.arm.plausible import check_poses
from camcomp.diagnosis.arm.poses import Poses, approached
from camcomp.diagnosis.arm.study import merged
from camcomp.diagnosis.arm.study import study as study_arm
from camcomp.diagnosis.axis.findings import AxisDeviation, AxisRun
from camcomp.diagnosis.axis.plausible import check_axes
from camcomp.diagnosis.axis.study import studied as study_axes
from camcomp.diagnosis.experiment.open_experiment import open_log, read_log
from camcomp.diagnosis.fit.measured import Measured
from camcomp.diagnosis.residuals import Columns, of_axes, of_poses
from camcomp.diagnosis.result.types import DiagnosisResult
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location
from camcomp.ground.files import display_name
from camcomp.model.config.load import load_config, load_experiment
from camcomp.model.config.spec import Config, RunSpec
from camcomp.model.effect import Cause
from camcomp.model.motion.log_columns import log_columns
from camcomp.model.statics.arm import arm_of
from camcomp.model.statics.build import build_robot

MOSTLY = 0.5  # share of rows with a value from which on a channel counts as logged, and rows without it as lost


@dataclass(frozen=True, eq=False)
class LogStudy:
    """The result of logs without programs. residuals: what it leaves, row by row (`camcomp.diagnosis.residuals`)."""

    result: DiagnosisResult
    residuals: Callable[[], Columns]


def study_of(path: str | Path, without: Sequence[str] = ()) -> LogStudy | None:
    """The study of an experiment without programs, of static poses or of axis logs; None where it is for the general diagnosis.

    Raises ConfigError CC420 where the logs say too little, CC407, CC408, CC412, CC413 where they cannot be of this machine
    as they are read.
    """
    experiment = load_experiment(path)
    config = load_config(experiment.config)
    robot, _ = build_robot(config.robot, config.tool.tip)
    columns = log_columns([a.name for a in robot.actuators], [a.revolute for a in robot.actuators])
    logs = [read_log(open_log(run.log), columns) for run in experiment.runs]
    try:
        if all(m.has("tip") and m.has("encoder") and not m.has("setpoint") for m in logs):
            if arm_of(robot) is None:
                return None
            runs = [_poses(run, log) for run, log in zip(experiment.runs, logs, strict=True)]
            for run, each in zip(experiment.runs, runs, strict=True):
                check_poses(display_name(run.log), run.name, robot, each.q, each.tip)
            sd = experiment.sd
            stated = StatedDeviation(sd.tip_mm, sd.encoder_mm) if sd else StatedDeviation()
            own = _causes(config)
            result = study_arm(robot, own, runs, holdout=experiment.holdout, without=without, stated=stated)
            return LogStudy(result, partial(of_poses, robot, own, merged(runs), result))
        if not any(m.has("tip") for m in logs) and all(m.has("encoder") for m in logs):
            axes = {
                a.name: [_axis(run, log, k, a.revolute) for run, log in zip(experiment.runs, logs, strict=True)]
                for k, a in enumerate(robot.actuators)
            }
            for i, run in enumerate(experiment.runs):
                check_axes(display_name(run.log), {name: own[i] for name, own in axes.items()})
            sd = experiment.sd
            deviation = AxisDeviation(sd.encoder_mm, sd.force_N) if sd else AxisDeviation()
            result, found = study_axes(axes, holdout=experiment.holdout, without=without, stated=deviation)
            return LogStudy(result, partial(of_axes, found, {a.name: a.revolute for a in robot.actuators}))
    except ValidationError:  # a ValueError too, and a fault of ours
        raise
    except ValueError as error:
        raise ConfigError("CC420", str(error), at=Location(display_name(path), 1, 1)) from error
    return None


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
        label, log.encoder, log.tip, run.started_s + log.time, heat, np.full(n, run.name), sd, np.arange(1, n + 1)
    ).take(known)
    return replace(every, approach=approached(every.q, every.time))


def _filled(time: Floats, values: Floats) -> Floats | None:
    """A channel (n,) that is logged, its empty cells between those in front of and behind them; None where it is not."""
    known = np.isfinite(values)
    if known.mean() <= MOSTLY:
        return None
    order = np.flatnonzero(known)[np.argsort(time[known], kind="stable")]
    return np.where(known, values, np.interp(time, time[order], values[order]))


def _axis(run: RunSpec, log: Measured, k: int, revolute: bool) -> AxisRun:
    """Rows, one per time and in its order, with all that the log has of this axis.

    Torques of hinges are not studied: their friction has other units.
    """
    force = np.full(len(log.time), np.nan) if revolute else log.drive[:, k]
    channels = (log.encoder[:, k], log.setpoint[:, k], force)
    known = np.isfinite(log.encoder[:, k])
    for each in channels:
        if np.isfinite(each).mean() > MOSTLY:
            known &= np.isfinite(each)
    rows = np.flatnonzero(known)
    rows = rows[np.unique(log.time[rows], return_index=True)[1]]
    encoder, setpoint, force = (each[rows] for each in channels)
    return AxisRun(run.name, log.time[rows], setpoint, encoder, force, rows + 1, revolute, run.started_s)
