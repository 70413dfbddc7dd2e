"""camcomp compensate."""

from typing import TYPE_CHECKING

import click

from camcomp import __version__
from camcomp.ground.errors import CheckFailed
from camcomp.ground.files import display_name, open_source, read_bytes, write_all
from camcomp.ground.places import STANDARD
from camcomp.model.config.load import load_config
from camcomp.terminal.commands._options import OUTPUT, quiet_option
from camcomp.terminal.progress import say, working

if TYPE_CHECKING:
    from camcomp.compensation.program.result import Summary


@click.command()
@click.argument("program")
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
@click.option("--arcs/--no-arcs", default=None, help="Arcs come out as arcs where those are fewer than straight lines.")
@click.option("--dry-run", is_flag=True, help="Do everything but write.")
@quiet_option
def command(
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
    dry_run: bool,
    quiet: bool,
) -> None:
    """Write the deflection of the machine back into an NC program.

    PROGRAM is a G-code file, - reads standard input. Without any output option the corrected program goes to standard
    output. Exit code 1: everything is written, but a check failed, or the program was compensated before.
    """
    config = load_config(configs)
    if report:
        from camcomp.report.page import plot_library

        plot_library()  # a missing library is told before the work, not after it
    from camcomp.compensation.file_to_file import Wanted, compensate_long
    from camcomp.gcode.stamp import is_stamped
    from camcomp.model.job import Job

    job = Job(config)
    tolerance = tolerance_um or config.compensation.tolerance_um
    how, name = method or config.compensation.method, display_name(program)
    with open_source(program) as file:
        done = None
        if not (paths or report):
            standard = None if output or joints or summary_file else STANDARD
            with working(f"compensating {name}", quiet=quiet):
                done = compensate_long(
                    file, name, job, method=how, tolerance_um=tolerance, version=__version__, dry_run=dry_run, arcs=arcs,
                    wanted=Wanted(output or standard, joints, summary_file), inputs=(program, *configs),
                )  # fmt: skip
        if done is not None:
            _finish(done.figures, done.sizes if dry_run else {}, done.failed, quiet)
            return
        data = file.read()
    from camcomp.compensation.program.compensate import compensate, trajectories
    from camcomp.compensation.report import tables
    from camcomp.compensation.report.joint_table import joint_bytes
    from camcomp.model.control import program_of

    source = program_of(data, name, config)
    if is_stamped(source.data):
        raise CheckFailed("CC603", f"{source.name} was compensated before")
    with working(f"compensating {source.name}", quiet=quiet):
        result = compensate(source, job, method=how, tolerance_um=tolerance, version=__version__, arcs=arcs)
    figures = tables.summary(result, job)
    outputs: dict[str, bytes] = {}
    if output or not (joints or summary_file or paths or report):
        outputs[output or STANDARD] = result.written.data
    if joints:
        outputs[joints] = joint_bytes(result, job, joints)
    if paths:
        outputs[paths] = tables.paths_csv(result, trajectories(result, job))
    if summary_file:
        outputs[summary_file] = figures.to_json()
    failed = result.failed_checks(job, tolerance)
    if report:
        from camcomp.compensation.report.page import compensation_html
        from camcomp.report.inputs import Input

        inputs = [Input("program", source.name, source.data)]
        inputs += [Input("configuration", display_name(each), read_bytes(each)) for each in configs if each != STANDARD]
        with working("checking what was written, for the report", quiet=quiet):
            outputs[report] = compensation_html(
                result, job, figures, failed=failed, tolerance_um=tolerance, inputs=inputs
            )
    if not dry_run:
        write_all(outputs, inputs=(program, *configs))
    _finish(figures, {each: len(made) for each, made in outputs.items()} if dry_run else {}, failed, quiet)


def _finish(figures: "Summary", sizes: dict[str, int], failed: list[tuple[str, str]], quiet: bool) -> None:
    """Says what was done, or would have been, and raises the checks that failed."""
    say(*_told(figures), quiet=quiet)
    say(*(f"would write {name}: {size} bytes" for name, size in sizes.items()), quiet=quiet)
    if failed:
        first, *rest = (CheckFailed(rule, text) for rule, text in failed)
        first.others = tuple(rest)
        raise first


def _told(figures: "Summary") -> list[str]:
    before, after = figures.before, figures.after
    changes = ((figures.actuator_change_max_mm, "mm"), (figures.actuator_change_max_rad, "rad"))
    efforts = ((figures.actuator_force_max_N, "N"), (figures.actuator_torque_max_Nmm, "Nmm"))
    lines = [
        f"{figures.segments_in} motions in, {figures.points} end points out ({figures.method})",
        f"tip error before: rms {before.rms_um:.2f} um, max {before.max_um:.2f} um",
        f"tip error after:  rms {after.rms_um:.2f} um, max {after.max_um:.2f} um",
        f"largest change of an actuator {_either(*changes)}",
        f"largest drive force {_either(*efforts)}",
        f"platform tilt left {figures.platform_tilt_max_mrad:.2f} mrad",
    ]
    if checked := figures.interpolation:
        lines.append(
            f"interpolated between {checked.exact_solutions} exact solutions; {checked.checked} points checked: "
            f"{checked.worst_um:.4f} um at most, allowed {checked.bound_um:g} um"
        )
    return lines + [f"warning: {each}" for each in figures.warnings]


def _either(*figures: tuple[float | None, str]) -> str:
    """The figures that are not zero, with their units; a machine may have slides, hinges or both."""
    parts = [f"{most:.4g} {unit}" for most, unit in figures if most]
    return " and ".join(parts) or "0"
