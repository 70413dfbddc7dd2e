"""camcomp programs."""

from __future__ import annotations

import json
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from camcomp import __version__
from camcomp.ground.errors import CheckFailed
from camcomp.model.config.load import load_config
from camcomp.report.findings import Case, findings_of_messages
from camcomp.report.outputs import findings_files
from camcomp.terminal.commands._options import config_option, findings_options, quiet_option
from camcomp.terminal.progress import say

if TYPE_CHECKING:
    from camcomp.compensation.batch.programs import Status

SUMMARY = "camcomp-batch.json"


@click.command()
@click.argument("paths", metavar="PATH...", nargs=-1, required=True)
@config_option
@click.option("--output-dir", metavar="DIR", required=True, help="Where the tree of corrected programs goes.")
@click.option("--jobs", type=click.IntRange(min=1), help="Worker processes, one core each; default: all cores.")
@click.option(
    "--scheduler", metavar="ADDRESS", help="A running Dask scheduler, tcp://host:port, instead of this machine."
)
@click.option("--joints", is_flag=True, help="Write a joint table beside every program.")
@click.option("--method", type=click.Choice(["newton", "stiffness", "fixed-point", "linear"]), help="As in compensate.")
@click.option("--tolerance-um", type=click.FloatRange(min=0, min_open=True), help="Bound of the error left.")
@findings_options("sarif", "junit")
@quiet_option
def command(
    paths: tuple[str, ...],
    configs: tuple[str, ...],
    output_dir: str,
    jobs: int | None,
    scheduler: str | None,
    joints: bool,
    method: str | None,
    tolerance_um: float | None,
    sarif_file: str | None,
    junit_file: str | None,
    quiet: bool,
) -> int:
    """Compensate many programs at once.

    PATH is a program, a folder, or a pattern such as 'parts/**/*.nc'. The tree of inputs is mirrored in DIR. A program that
    fails does not stop the others; the exit code is then the largest of theirs. A second run skips what is done and
    unchanged: program, configuration, options, version and output. DIR/camcomp-batch.json tells what became of each.
    """
    if scheduler and jobs:
        raise click.UsageError("--jobs is about this machine; a scheduler has its own workers")
    config = load_config(configs)
    from camcomp.compensation.batch import pools
    from camcomp.compensation.batch.programs import Plan, find_programs, run_batch, summary
    from camcomp.ground.files import write_all
    from camcomp.ground.shelf import usable

    if config.control.dialect is None:
        list(usable("dialects"))  # says which plug-ins are left out; workers would say it once each
    plan = Plan(
        config, configs, Path(output_dir), method or config.compensation.method,
        tolerance_um or config.compensation.tolerance_um, joints, __version__,
    )  # fmt: skip
    programs = find_programs(paths, plan.output)
    if scheduler:
        pool = partial(pools.on_a_cluster, address=scheduler)
    else:
        pool = partial(pools.on_this_machine, jobs=min(jobs or pools.cores(), len(programs)))
    statuses = []
    for status in run_batch(plan, programs, pool):
        statuses.append(status)
        if not quiet or status.exit_code:
            _tell(status, len(statuses), len(programs))
    figures = summary(statuses)
    plan.output.mkdir(parents=True, exist_ok=True)
    write_all({plan.output / SUMMARY: (json.dumps(figures, indent=2) + "\n").encode()})
    cases = [_case(each) for each in sorted(statuses, key=lambda each: each.source)]
    write_all(findings_files("batch", cases, sarif_file=sarif_file, junit_file=junit_file))
    counts = ", ".join(f"{count} {name}" for name, count in figures["counts"].items() if count)
    say(f"{figures['programs']} programs: {counts}", quiet=quiet)
    out: int = figures["exit_code"]
    return out


def _case(status: Status) -> Case:
    check = status.exit_code == CheckFailed.exit_code
    findings = findings_of_messages(status.messages, status.source, check=check)
    return Case(status.source, findings, status.status)


def _tell(status: Status, number: int, total: int) -> None:
    text = f"[{number}/{total}] {status.status}: {status.source}"
    if status.figures:
        before, after = (status.figures[each]["max_um"] for each in ("before", "after"))
        text += f": largest error {before:.1f} um, now {after:.2f} um"
    print("\n".join([text, *("  " + each["text"].replace("\n", "\n  ") for each in status.messages)]), file=sys.stderr)
