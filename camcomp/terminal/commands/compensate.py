"""camcomp compensate."""

from typing import TYPE_CHECKING, Literal

import click

from camcomp.ground.errors import CheckFailed
from camcomp.ground.files import display_name
from camcomp.terminal.commands._figures import controller_line, expected_error_lines, warning_lines
from camcomp.terminal.commands._options import OUTPUT, dialect_option, quiet_option, stock_option
from camcomp.terminal.progress import say, working

if TYPE_CHECKING:
    from camcomp.api.compensation import Summary
    from camcomp.api.machine import StockChoice

LEAST_TILT_MRAD = 0.005  # below it the two decimals show none
LEAST_FIGURE = 1e-8  # mm, rad, N or N mm: smaller figures are rounding errors of zero


@click.command()
@click.argument("program")
@dialect_option
@click.option("--config", "configs", metavar="FILE", multiple=True, required=True, help="Machine; later files win.")
@click.option("-o", "--output", metavar="OUT.nc", type=OUTPUT, help="Corrected program; - is standard output.")
@click.option(
    "--joints",
    metavar="OUT.csv",
    type=OUTPUT,
    help="Actuator coordinates and drive forces at every end point; .parquet too.",
)
@click.option("--summary", "summary_file", metavar="OUT.json", type=OUTPUT, help="Figures of the run.")
@click.option(
    "--paths", metavar="OUT.csv", type=OUTPUT, help="The five trajectories: target, errors, force, both, adjusted."
)
@click.option("--report", metavar="OUT.html", type=OUTPUT, help="What was done and why, as one page with plots.")
@click.option(
    "--method",
    type=click.Choice(["newton", "stiffness", "fixed-point", "linear"]),
    help="How the target is found; default: what the machine file says, newton.",
)
@click.option("--tolerance-um", type=click.FloatRange(min=1e-6), help="Bound of the error left.")
@click.option(
    "--arcs/--no-arcs",
    default=None,
    help="Programmed arcs come out as arcs where those are fewer than lines; default: where the control is better off.",
)
@click.option(
    "--mirror",
    metavar="LOG.csv",
    multiple=True,
    help="Log of a test cut: its deviation in reverse instead of the model's; again for a cut of what that gave.",
)
@stock_option
@click.option(
    "--if-compensated",
    type=click.Choice(["refuse", "pass"]),
    default="refuse",
    show_default=True,
    help="What becomes of a program that was compensated before: exit code 1, or it passes unchanged.",
)
@click.option("--dry-run", is_flag=True, help="Do everything but write.")
@quiet_option
def command(
    *,
    program: str,
    configs: tuple[str, ...],
    output: str | None,
    joints: str | None,
    summary_file: str | None,
    paths: str | None,
    report: str | None,
    method: str | None,
    tolerance_um: float | None,
    arcs: bool | None,
    mirror: tuple[str, ...],
    stock: "StockChoice | None",
    if_compensated: Literal["refuse", "pass"],
    dry_run: bool,
    quiet: bool,
) -> None:
    """Write the deflection of the machine back into an NC program.

    PROGRAM is a G-code file, - reads standard input. Without any output option the corrected program goes to standard
    output. Exit code 1: everything is written, but a check failed, or the program was compensated before.
    """
    from camcomp.api.compensation import compensate_file

    with working(f"compensating {display_name(program)}", quiet=quiet):
        done = compensate_file(
            program, configs, output=output, joints=joints, summary=summary_file, paths=paths, report=report, method=method,
            tolerance_um=tolerance_um, arcs=arcs, mirror=mirror, dry_run=dry_run, stock=stock, if_compensated=if_compensated,
        )  # fmt: skip
    if done is None:
        say(f"{display_name(program)} was compensated before and passes unchanged", quiet=quiet)
        return
    _finish(done.figures, done.sizes if dry_run else {}, done.failed, quiet)


def _finish(figures: "Summary", sizes: dict[str, int], failed: list[tuple[str, str]], quiet: bool) -> None:
    """Print the figures of a compensation or dry run, and raise the checks that failed."""
    say(*_told(figures), quiet=quiet)
    say(*(f"would write {name}: {size} bytes" for name, size in sizes.items()), quiet=quiet)
    if failed:
        first, *rest = (CheckFailed(rule, text) for rule, text in failed)
        first.others = tuple(rest)
        raise first


def _told(figures: "Summary") -> list[str]:
    before, after = figures.before, figures.after
    changes = ((figures.actuator_change_max_mm, "mm", 1.0), (figures.actuator_change_max_rad, "mrad", 1e3))
    efforts = ((figures.actuator_force_max_N, "N", 1.0), (figures.actuator_torque_max_Nmm, "N m", 1e-3))
    motions = f"{figures.segments_in} motions in, {figures.points} end points out ({figures.method})"
    lines = [
        f"{motions}; {figures.lines_in} lines become {figures.lines_out}",
        f"force: {figures.force.text}",
        *(f"read from the program: {each}" for each in figures.stated_in_program or ()),
        f"tip error before: rms {before.rms_um:.2f} um, max {before.max_um:.2f} um",
        f"tip error after:  rms {after.rms_um:.2f} um, max {after.max_um:.2f} um",
        f"largest correction at an actuator {_either(*changes)}, largest drive load {_either(*efforts)}",
    ]
    if (tilt := figures.platform_tilt_max_mrad) >= LEAST_TILT_MRAD:
        lines.append(f"platform tilt under load {tilt:.2f} mrad; a program without orientation words cannot correct it")
    if joins := figures.joining_lines:
        lines.append(f"{joins} joining lines where the cutting force jumps; not counted in the tip error")
    if taken := figures.taken:
        lines.append(
            f"policy {taken.policy}: of {taken.points} points {taken.shrunk} take less than all of the correction and "
            f"{taken.left_alone} none"
        )
    lines += expected_error_lines(figures)
    if checked := figures.interpolation:
        lines.append(
            f"interpolated between {checked.exact_solutions} exact solutions; {checked.checked} points checked: "
            f"{checked.worst_um:.4f} um at most, allowed {checked.bound_um:g} um"
        )
    lines.append(controller_line(figures))
    if not figures.control_mode_stated and figures.under_control.max_um > figures.after.max_um:
        lines.append(
            "  state the controller's mode as `control: {path_mode: G64 P0.01}` to have the program written for it"
        )
    return lines + warning_lines(figures.warnings)


def _either(*figures: tuple[float | None, str, float]) -> str:
    """The figures above rounding errors in the units of the text (factors); a machine has slides, hinges or both."""
    parts = [f"{most * factor:.4g} {unit}" for most, unit, factor in figures if most and most > LEAST_FIGURE]
    return " and ".join(parts) or "0"
