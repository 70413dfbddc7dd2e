"""camcomp validate."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

import click

from camcomp.ground.errors import CamcompError, raise_all
from camcomp.ground.files import display_name, read_bytes, write_all
from camcomp.ground.places import STANDARD
from camcomp.model.config.load import check_config, is_experiment, load_config, load_experiment
from camcomp.report.findings import WARNING, Case, Finding, findings_of
from camcomp.report.outputs import findings_files
from camcomp.terminal.commands._options import findings_options, quiet_option

T = TypeVar("T")


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True)
@click.option("--config", "configs", metavar="FILE", multiple=True, help="Machine whose control reads the programs.")
@findings_options("json", "sarif", "junit")
@quiet_option
def command(
    files: tuple[str, ...],
    configs: tuple[str, ...],
    json_file: str | None,
    sarif_file: str | None,
    junit_file: str | None,
    quiet: bool,
) -> None:
    """Check YAML files and NC programs; report every error at once.

    Of an NC program the first mistake is told, since what follows it cannot be read for sure. A file of overrides is
    checked as far as it goes, an experiment file together with the machine files, programs and logs it names.
    Everything that does not end in .yaml or .yml is read as an NC program.
    """
    errors: list[CamcompError] = []
    cases: list[Case] = []
    silent = quiet or STANDARD in (json_file, sarif_file, junit_file)
    for file in files:
        found: list[CamcompError] = []
        checked = _collect(found, partial(_check, file, configs))
        name = display_name(file)
        kind, warnings = checked or ("", ())
        if checked and not silent:
            click.echo(f"{name}: ok ({kind})")
        if not quiet:
            for each in warnings:
                click.echo(f"{name}: warning: {each}", err=True)
        notes = [Finding(WARNING, each, name) for each in warnings]
        cases.append(Case(name, [*(f for each in found for f in findings_of(each, name)), *notes], kind))
        errors += found
    outputs = findings_files("validate", cases, json_file=json_file, sarif_file=sarif_file, junit_file=junit_file)
    write_all(outputs, inputs=(*files, *configs))
    raise_all(errors)


def _check(file: str, configs: tuple[str, ...]) -> tuple[str, Sequence[str]]:
    """What the file is, and warnings about it."""
    if Path(file).suffix.lower() not in (".yaml", ".yml"):
        return _check_program(file, configs)
    if is_experiment(read_bytes(file)):
        return _check_experiment(file), ()
    check_config([file])
    return "configuration", ()


def _check_program(file: str, configs: tuple[str, ...]) -> tuple[str, Sequence[str]]:
    from camcomp.model.control import open_program  # NumPy and the reader: only when there is a program

    program = open_program(file, load_config(configs) if configs else None)
    return f"program, {program.dialect}, {len(program.path)} motions", program.warnings


def _check_experiment(file: str) -> str:
    experiment = load_experiment(file)
    errors: list[CamcompError] = []
    config = _collect(errors, partial(load_config, experiment.config))
    for run in experiment.runs:
        _collect(errors, partial(read_bytes, run.log))
        if run.program is not None:
            from camcomp.model.control import open_program

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
