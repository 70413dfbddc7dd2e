"""camcomp validate."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

import click

from camcomp.config import check_config, is_experiment, load_config, load_experiment
from camcomp.diagnostics import CamcompError, raise_all
from camcomp.files import display_name, read_bytes

T = TypeVar("T")


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True)
@click.option(
    "--config", "configs", metavar="FILE", multiple=True, help="Machine whose control reads the programs."
)
def command(files: tuple[str, ...], configs: tuple[str, ...]) -> None:
    """Check YAML files and NC programs; report every error at once.

    Of an NC program the first mistake is told, since what follows it cannot be read for sure. A file of overrides is
    checked as far as it goes, an experiment file together with the machine files, programs and logs it names.
    Everything that does not end in .yaml or .yml is read as an NC program.
    """
    errors: list[CamcompError] = []
    for file in files:
        kind = _collect(errors, partial(_check, file, configs))
        if kind is not None:
            click.echo(f"{display_name(file)}: ok ({kind})")
    raise_all(errors)


def _check(file: str, configs: tuple[str, ...]) -> str:
    if Path(file).suffix.lower() not in (".yaml", ".yml"):
        return _check_program(file, configs)
    if is_experiment(read_bytes(file)):
        return _check_experiment(file)
    check_config([file])
    return "configuration"


def _check_program(file: str, configs: tuple[str, ...]) -> str:
    from camcomp.programs import open_program  # NumPy and the reader: only when there is a program

    program = open_program(file, load_config(configs) if configs else None)
    for warning in program.warnings:
        click.echo(f"{display_name(file)}: warning: {warning}", err=True)
    return f"program, {program.dialect}, {len(program.path)} motions"


def _check_experiment(file: str) -> str:
    experiment = load_experiment(file)
    errors: list[CamcompError] = []
    config = _collect(errors, partial(load_config, experiment.config))
    for run in experiment.runs:
        _collect(errors, partial(read_bytes, run.log))
        if run.program is not None:
            from camcomp.programs import open_program

            _collect(errors, partial(open_program, run.program, config))
    raise_all(errors)
    return f"experiment, {len(experiment.runs)} runs"


def _collect(errors: list[CamcompError], read: Callable[[], T]) -> T | None:
    """What `read` gives, or None and one more of `errors`."""
    try:
        return read()
    except CamcompError as error:
        errors.append(error)
        return None
