"""camcomp validate."""

from pathlib import Path

import click

from camcomp.config import check_config, is_experiment, load_config, load_experiment
from camcomp.diagnostics import CamcompError, raise_all
from camcomp.files import STANDARD, display_name, read_bytes


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True)
@click.option(
    "--config", "configs", metavar="FILE", multiple=True, help="Machine whose control reads the programs."
)
def command(files: tuple[str, ...], configs: tuple[str, ...]) -> None:
    """Check YAML files and NC programs; report every error at once.

    A file of overrides is checked as far as it goes. An experiment file is checked together with the machine files,
    programs and logs it names. Everything that does not end in .yaml or .yml is read as an NC program.
    """
    errors: list[CamcompError] = []
    for file in files:
        try:
            kind = _check(file, configs)
        except CamcompError as error:
            errors.append(error)
        else:
            click.echo(f"{display_name(file)}: ok ({kind})")
    raise_all(errors)


def _check(file: str, configs: tuple[str, ...]) -> str:
    if Path(file).suffix.lower() not in (".yaml", ".yml"):
        return _check_program(file, configs)
    if file != STANDARD and is_experiment(read_bytes(file)):
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
    config = None
    try:
        config = load_config(experiment.config)
    except CamcompError as error:
        errors.append(error)
    for run in experiment.runs:
        try:
            read_bytes(run.log)
            if run.program is not None and config is not None:
                from camcomp.programs import open_program

                open_program(run.program, config)
        except CamcompError as error:
            errors.append(error)
    raise_all(errors)
    return f"experiment, {len(experiment.runs)} runs"
