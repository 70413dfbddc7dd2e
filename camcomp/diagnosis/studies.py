"""Experiments whose runs have no program: which study they are for, and their logs as that study wants them.

Static poses of an arm (encoders and measured tips, no set-points) and logs of axes (set-points, encoders, drive forces,
no tips) have studies of their own. Everything else goes to the general diagnosis.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from camcomp.diagnosis.arm.poses import Poses
from camcomp.diagnosis.arm.study import study as study_arm
from camcomp.diagnosis.axis.study import AxisRun
from camcomp.diagnosis.axis.study import study as study_axes
from camcomp.diagnosis.experiment.open_experiment import open_log, read_log
from camcomp.diagnosis.fit.measured import Measured
from camcomp.diagnosis.result.types import DiagnosisResult
from camcomp.ground import shelf
from camcomp.ground.errors import ConfigError, Location
from camcomp.ground.files import display_name
from camcomp.model.config.load import load_config, load_experiment
from camcomp.model.config.spec import Config, RunSpec
from camcomp.model.effect import Cause
from camcomp.model.motion.log_columns import log_columns
from camcomp.model.statics.arm import arm_of
from camcomp.model.statics.build import build_robot


def study_of(path: str | Path, without: Sequence[str] = ()) -> DiagnosisResult | None:
    """Result of an experiment of static poses or of axis logs; None where it is for the general diagnosis.

    Raises ConfigError CC420 where the logs say too little.
    """
    experiment = load_experiment(path)
    if any(run.program is not None for run in experiment.runs):
        return None
    config = load_config(experiment.config)
    robot, _ = build_robot(config.robot, config.tool.tip)
    columns = log_columns([a.name for a in robot.actuators], [a.revolute for a in robot.actuators])
    logs = [read_log(open_log(run.log), columns) for run in experiment.runs]
    try:
        if all(m.has("tip") and m.has("encoder") and not m.has("setpoint") for m in logs):
            if arm_of(robot) is None:
                return None
            runs = [_poses(run, log) for run, log in zip(experiment.runs, logs, strict=True)]
            return study_arm(robot, _causes(config), runs, holdout=experiment.holdout, without=without)
        if not any(m.has("tip") for m in logs) and all(m.has("encoder") for m in logs):
            axes = {
                a.name: [_axis(run, log, k, a.revolute) for run, log in zip(experiment.runs, logs, strict=True)]
                for k, a in enumerate(robot.actuators)
            }
            return study_axes(axes, holdout=experiment.holdout, without=without)
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
    heat = log.temperature if len(known) and np.isfinite(log.temperature[known]).all() else None
    label = "common" if run.clamping is None else str(run.clamping)
    every = Poses(label, log.encoder, log.tip, run.started_s + log.time, heat, np.full(len(log.time), run.name))
    return every.take(known)


def _axis(run: RunSpec, log: Measured, k: int, revolute: bool) -> AxisRun:
    """Rows with an encoder value. Torques of hinges are not studied: their friction has other units."""
    known = np.isfinite(log.encoder[:, k])
    force = np.full(len(log.time), np.nan) if revolute else log.drive[:, k]
    return AxisRun(run.name, log.time[known], log.setpoint[known, k], log.encoder[known, k], force[known])
