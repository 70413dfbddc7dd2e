"""camcomp validate."""

from typing import TYPE_CHECKING

import click

from camcomp.ground.errors import CamcompError, raise_all, shown
from camcomp.ground.files import display_name, write_all
from camcomp.ground.places import STANDARD
from camcomp.report.findings import WARNING, Case, Finding, findings_of
from camcomp.report.outputs import findings_files
from camcomp.terminal.commands._options import dialect_option, findings_options, quiet_option
from camcomp.terminal.progress import say

if TYPE_CHECKING:
    from camcomp.api.validation import Doubt


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True)
@dialect_option
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
    from camcomp.api.validation import check_file

    errors: list[CamcompError] = []
    cases: list[Case] = []
    silent = quiet or STANDARD in (json_file, sarif_file, junit_file)
    for file in files:
        found: list[CamcompError] = []
        name, kind, warnings = display_name(file), "", list["Doubt"]()
        try:
            kind, warnings = check_file(file, configs)
            if not silent:
                click.echo(shown(f"{name}: ok ({kind})"))
        except CamcompError as error:
            found.append(error)
        if not quiet:
            for each in warnings:
                say(f"{_place(each, name)}: warning: {each.text}")
        notes = [_note(each, name) for each in warnings]
        cases.append(Case(name, [*(f for each in found for f in findings_of(each, name)), *notes], kind))
        errors += found
    outputs = findings_files("validate", cases, json_file=json_file, sarif_file=sarif_file, junit_file=junit_file)
    write_all(outputs, inputs=(*files, *configs))
    raise_all(errors)


def _place(doubt: "Doubt", name: str) -> str:
    return f"{doubt.at.file}:{doubt.at.line}:{doubt.at.column}" if doubt.at else name


def _note(doubt: "Doubt", name: str) -> Finding:
    at = doubt.at
    return (
        Finding(rule=WARNING, message=doubt.text, file=at.file, line=at.line, column=at.column)
        if at
        else Finding(rule=WARNING, message=doubt.text, file=name)
    )
