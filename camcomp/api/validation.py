"""Validation of YAML files and NC programs: all errors of a later run, and warnings about implausible values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

from camcomp.ground.errors import CamcompError, raise_all
from camcomp.ground.files import read_bytes
from camcomp.model.config.doubt import Doubt
from camcomp.model.config.load import check_config, is_experiment, load_config, load_experiment
from camcomp.model.config.plausible import doubts
from camcomp.model.config.spec import Config

__all__ = ["Doubt", "check_file"]

T = TypeVar("T")


def check_file(file: str, configs: Sequence[str] = ()) -> tuple[str, list[Doubt]]:
    """Kind of a file, and warnings about it; configs: the machine whose controller reads programs.

    Raises CamcompError with all errors of the file.
    """
    if Path(file).suffix.lower() not in (".yaml", ".yml"):
        return _check_program(file, configs)
    if is_experiment(read_bytes(file)):
        return _check_experiment(file)
    config = check_config([file])
    if config is None:
        return "configuration", []
    count = len(config.robot.actuators)
    if count in (3, 6):
        _build(config)
        return "configuration", doubts(config)
    _build_robot(config)
    text = f"{count} actuators: logs of joints and static poses can be diagnosed; to correct programs a machine needs three or six"
    return "configuration", [*doubts(config), Doubt(text, config.at("robot"))]


def _build(config: Config) -> None:
    """Build the machine of a file with its effects. Raises ConfigError."""
    from camcomp.model.job import Job

    job = Job(config)
    _ = job.machine, job.real_machine


def _build_robot(config: Config) -> None:
    """Build the chains of a machine with its effects, which suffices for logs without programs. Raises ConfigError."""
    from camcomp.model import signal_path
    from camcomp.model.job import Job
    from camcomp.model.statics.build import build_robot

    robot, _ = build_robot(config.robot, config.tool.tip)
    signal_path.edited(Job(config).causes, tuple(each.name for each in robot.actuators), robot)


def _check_program(file: str, configs: Sequence[str]) -> tuple[str, list[Doubt]]:
    from camcomp.model.control import open_program  # slow import, needed for programs only

    program = open_program(file, load_config(configs) if configs else None)
    warnings = [Doubt(each, None) for each in program.warnings]
    return f"program, {program.dialect}, {len(program.path)} motions", warnings


def _check_experiment(file: str) -> tuple[str, list[Doubt]]:
    from camcomp.diagnosis.experiment.open_experiment import check_log
    from camcomp.model.control import open_program

    experiment = load_experiment(file)
    errors: list[CamcompError] = []
    config = _collect(errors, partial(check_config, experiment.config))
    if config is not None:
        moved = any(run.program is not None for run in experiment.runs)
        _collect(errors, partial(_build if moved else _build_robot, config))
    for run in experiment.runs:
        _collect(errors, partial(check_log, run.log, config))
        if run.program is not None:
            _collect(errors, partial(open_program, run.program, config))
    raise_all(errors)
    runs = f"{len(experiment.runs)} run{'' if len(experiment.runs) == 1 else 's'}"
    return f"experiment, {runs}", [] if config is None else doubts(config)


def _collect(errors: list[CamcompError], read: Callable[[], T]) -> T | None:
    """Result of `read`, or None with its error appended to `errors`."""
    try:
        return read()
    except CamcompError as error:
        errors.append(error)
        return None
