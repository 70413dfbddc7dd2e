"""camcomp verify."""

from typing import TYPE_CHECKING

import click

from camcomp.ground.errors import CamcompError, CheckFailed
from camcomp.ground.files import display_name, write_all
from camcomp.ground.source_lines import named_lines
from camcomp.report.findings import Case, Finding, findings_of
from camcomp.report.outputs import findings_files
from camcomp.terminal.commands._figures import controller_line, expected_error_lines, warning_lines
from camcomp.terminal.commands._options import OUTPUT, dialect_option, findings_options, quiet_option, stock_option
from camcomp.terminal.progress import say, working

if TYPE_CHECKING:
    from camcomp.api.machine import Program, StockChoice
    from camcomp.api.verification import LineResult, Verified

_NOT_COMPENSATED = "the program has no stamp of camcomp compensate: compensate it first"


@click.command()
@click.argument("corrected")
@dialect_option
@click.option("--against", "original", metavar="ORIGINAL", required=True, help="Program that was compensated.")
@click.option("--config", "configs", metavar="FILE", multiple=True, required=True, help="Machine; later files win.")
@click.option("--json", "json_file", metavar="OUT.json", type=OUTPUT, help="Residuals, in all and per source line.")
@findings_options("sarif", "junit")
@quiet_option
@stock_option
@click.option("--tolerance-um", type=click.FloatRange(min=1e-6), help="Largest residual that passes.")
def command(
    *,
    corrected: str,
    original: str,
    configs: tuple[str, ...],
    json_file: str | None,
    sarif_file: str | None,
    junit_file: str | None,
    quiet: bool,
    stock: "StockChoice | None",
    tolerance_um: float | None,
) -> None:
    """Run a compensated program through the model and measure the residual error.

    Only the text of CORRECTED counts. Exit code 1 when the residual is over the tolerance.
    """
    from camcomp.api.machine import load_machine, read_program
    from camcomp.api.verification import verify

    machine = load_machine(*configs)
    tolerance = tolerance_um or machine.config.compensation.tolerance_um
    findings: list[Finding] = []
    outputs: dict[str, bytes] = {}
    failure: CamcompError | None = None
    note = ""
    try:
        source = read_program(original, machine)
        with working("settling the corrected program", quiet=quiet):
            done = verify(corrected, source, machine, stock)
        figures = done.figures(tolerance)
        if json_file:
            outputs[json_file] = figures.to_json()
        size = figures.residual
        note = f"residual rms {size.rms_um:.2f} um, max {size.max_um:.2f} um at {figures.points} points"
        joining = f"; {done.joining} joining lines not counted" if done.joining else ""
        say(note + joining, *_lines_of(done), quiet=quiet)
        say(controller_line(figures), *expected_error_lines(figures), quiet=quiet)
        if not done.worst_um <= tolerance * (1.0 + 1e-9):
            over = [each for each in done.lines if each.judged_um > tolerance]
            lines = named_lines([each.line for each in over])
            text = f"{done.worst_um:.3f} um are left, more than {tolerance:g} um, at {lines}"
            failure = CheckFailed("CC601", text, hint=None if done.stamped else _NOT_COMPENSATED)
            findings = [_finding(each, source, tolerance) for each in over]
    except CamcompError as error:
        failure, findings = error, findings_of(error, display_name(corrected))
    case = Case(display_name(corrected), findings, note)
    outputs |= findings_files("verify", [case], sarif_file=sarif_file, junit_file=junit_file)
    write_all(outputs, inputs=(corrected, original, *configs))
    if failure is not None:
        raise failure


def _lines_of(done: "Verified") -> list[str]:
    """Text for the terminal: the ten worst source lines, and warnings."""
    worst = [
        f"  line {each.line}: {each.residual_um:.2f} um in {each.moves} move{'' if each.moves == 1 else 's'} "
        f"(at end points {each.vertex_um:.2f}, between them {each.chord_um:.2f} more; rounding of the words up to "
        f"{each.rounding_um:.2f})"
        for each in sorted(done.lines, key=lambda e: -e.residual_um)[:10]
    ]
    return worst + warning_lines(done.warnings)


def _finding(line: "LineResult", source: "Program", tolerance: float) -> Finding:
    """The failed check of a source line, with its place in the original program."""
    at = source.text.place(line.line - 1, 0)
    return Finding(
        rule="CC601", message=f"{line.judged_um:.3f} um are left, more than {tolerance:g} um", file=at.file, line=at.line,
        column=at.column, source=at.source, check=True,
    )  # fmt: skip
