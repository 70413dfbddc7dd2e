"""camcomp programs."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Literal

import click

from camcomp.ground import progress
from camcomp.ground.files import display_name
from camcomp.terminal.commands._figures import warning_lines
from camcomp.terminal.commands._options import (
    config_option,
    dialect_option,
    findings_options,
    quiet_option,
    stock_option,
)
from camcomp.terminal.progress import say, working

if TYPE_CHECKING:
    from camcomp.api.batch import Status
    from camcomp.api.machine import StockChoice


@click.command()
@click.argument("paths", metavar="PATH...", nargs=-1, required=True)
@dialect_option
@config_option
@click.option("--output-dir", metavar="DIR", required=True, help="Where the tree of corrected programs goes.")
@click.option("--jobs", type=click.IntRange(min=1), help="Worker processes, one core each; default: all cores.")
@click.option(
    "--scheduler", metavar="ADDRESS", help="A running Dask scheduler, tcp://host:port, instead of this machine."
)
@click.option("--joints", is_flag=True, help="Write a joint table beside every program.")
@click.option("--method", type=click.Choice(["newton", "stiffness", "fixed-point", "linear"]), help="As in compensate.")
@click.option("--tolerance-um", type=click.FloatRange(min=1e-6), help="Bound of the error left.")
@stock_option
@click.option(
    "--if-compensated",
    type=click.Choice(["refuse", "pass"]),
    default="refuse",
    show_default=True,
    help="What becomes of programs that were compensated before: exit code 1, or they pass unchanged.",
)
@findings_options("sarif", "junit")
@quiet_option
def command(
    *,
    paths: tuple[str, ...],
    configs: tuple[str, ...],
    output_dir: str,
    jobs: int | None,
    scheduler: str | None,
    joints: bool,
    method: str | None,
    tolerance_um: float | None,
    stock: StockChoice | None,
    if_compensated: Literal["refuse", "pass"],
    sarif_file: str | None,
    junit_file: str | None,
    quiet: bool,
) -> int:
    """Compensate many programs at once.

    PATH is a program, a folder, or a pattern such as 'parts/**/*.nc'. The tree of inputs is mirrored in DIR. A program that
    fails does not stop the others; the exit code is then the largest of theirs. A second run skips what is done and
    unchanged: program, configuration, options, version and output. DIR/camcomp-batch.json tells what became of each, also
    when the batch ends early: what is done then counts for the next run. One batch at a time writes into DIR. Without a
    worker in the cluster the batch says so after 5 s and waits; when the scheduler goes away it ends with exit code 5.
    """
    if scheduler == "":
        raise click.BadParameter("the address of the scheduler is empty", param_hint="--scheduler")
    if scheduler and jobs:
        raise click.UsageError("--jobs is about this machine; a scheduler has its own workers")
    from camcomp.api.batch import ERROR, compensate_many

    def on_status(status: Status, number: int, total: int) -> None:
        progress.done(number / total)
        if not quiet or status.exit_code:
            _tell(status, number, total)

    with working(f"compensating into {output_dir}", quiet=quiet):
        done = compensate_many(
            paths, configs, output_dir, jobs=jobs, scheduler=scheduler, joints=joints, method=method, tolerance_um=tolerance_um, stock=stock, if_compensated=if_compensated,
            sarif_file=sarif_file, junit_file=junit_file, tell=partial(say, quiet=False), on_status=on_status,
        )  # fmt: skip
    counts = ", ".join(
        f"{count} {name}{'s' if name == ERROR and count > 1 else ''}" for name, count in done["counts"].items() if count
    )
    say(f"{done['programs']} program{'' if done['programs'] == 1 else 's'}: {counts}", quiet=quiet)
    out: int = done["exit_code"]
    return out


def _tell(status: Status, number: int, total: int) -> None:
    from camcomp.api.batch import DONE

    text = f"[{number}/{total}] {status.status}: {display_name(status.source)}"
    if status.figures:
        before, after = (status.figures[each]["max_um"] for each in ("before", "after"))
        text += f": largest error {before:.1f} um, now {after:.2f} um"
    elif status.status == DONE:
        text += ": compensated before, copied unchanged"
    warnings = [f"  {each}" for each in warning_lines(status.figures.get("warnings", ()))]
    say(text, *warnings, *("  " + each["text"].replace("\n", "\n  ") for each in status.messages))
