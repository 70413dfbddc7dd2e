"""camcomp diagnose."""

import sys

import click

from camcomp.ground.errors import CheckFailed
from camcomp.ground.files import write_all
from camcomp.ground.places import STANDARD
from camcomp.terminal.commands._options import OUTPUT, dialect_option, quiet_option
from camcomp.terminal.progress import say, working


@click.command()
@click.argument("experiment")
@dialect_option
@click.option("--json", "json_file", metavar="OUT.json", type=OUTPUT, help="The result; - is standard output.")
@click.option("--report", metavar="OUT.html", type=OUTPUT, help="What was found and why, as one page with plots.")
@click.option(
    "--write-config",
    "config_file",
    metavar="OUT.yaml",
    type=OUTPUT,
    help="The machine file with the causes as effects.",
)
@click.option(
    "--next-program",
    metavar="OUT.nc",
    type=OUTPUT,
    help="NC program of the proposed next experiment; for an arm the poses to measure (CSV, or .json).",
)
@click.option(
    "--residuals",
    metavar="OUT.csv",
    type=OUTPUT,
    help="Measured minus modelled, row by row, without and with the causes; .parquet too.",
)
@click.option("--without", multiple=True, metavar="EFFECT", help="Take an effect out of the library; repeatable.")
@click.option(
    "--library", metavar="DIR", help="Folder of laws found before: candidates too; a law that is found is added."
)
@quiet_option
def command(
    *,
    experiment: str,
    json_file: str | None,
    report: str | None,
    config_file: str | None,
    next_program: str | None,
    residuals: str | None,
    without: tuple[str, ...],
    library: str | None,
    quiet: bool,
) -> None:
    """Find out why a machine and its model differ.

    EXPERIMENT is a YAML file that names the config under judgement and the runs with their programs and logs. The answer goes
    to standard error; the whole result as JSON to --json, or to standard output where that is no terminal and no other output is
    asked for.
    """
    if report:
        from camcomp.report.page import plot_library

        plot_library()  # a missing library is told before the work, not after it
    from camcomp.api.diagnosis import diagnose

    with working(f"diagnosing {experiment}", quiet=quiet):
        done = diagnose(experiment, without, library)
    for each in done.notes:
        say(f"note: {each}")
    outputs: dict[str, bytes] = {}
    if json_file or not (sys.stdout.isatty() or report or config_file or next_program or residuals):
        outputs[json_file or STANDARD] = done.result.to_json()
    if report:
        with working("drawing the report", quiet=quiet):
            outputs[report] = done.report()
    if config_file:
        outputs[config_file] = done.machine_with_causes(config_file).encode("utf-8", "backslashreplace")
    if residuals:
        outputs[residuals] = done.residuals.to_file(residuals)
    failure: CheckFailed | None = None
    if next_program:
        try:
            outputs[next_program] = done.next_program(next_program).encode()
            if done.next_program_cuts:
                say("warning: the proposed program cuts; look through it before it runs")
        except CheckFailed as error:
            failure = error
    write_all(outputs, inputs=(experiment, *(done.configs if config_file else ())))
    sys.stdout.flush()
    say(*done.answer, quiet=quiet)
    if failure is not None:
        raise failure
