"""camcomp programs."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camcomp import __version__
from camcomp.ground.errors import CamcompError, CheckFailed
from camcomp.model.config.load import load_config
from camcomp.report.findings import Case, findings_of_messages
from camcomp.report.outputs import findings_files
from camcomp.terminal.commands._options import config_option, findings_options, quiet_option
from camcomp.terminal.progress import say

if TYPE_CHECKING:
    from camcomp.compensation.batch.programs import FoundProgram, Plan, Status
    from camcomp.compensation.batch.worker import Outcome, Task

SUMMARY = "camcomp-batch.json"
INTERRUPTED = 130  # stands in the summary when a signal or a bug ended the batch


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
@click.option("--tolerance-um", type=click.FloatRange(min=1e-6), help="Bound of the error left.")
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
    unchanged: program, configuration, options, version and output. DIR/camcomp-batch.json tells what became of each, also
    when the batch ends early: what is done then counts for the next run. One batch at a time writes into DIR. Without a
    worker in the cluster the batch says so after 5 s and waits; when the scheduler goes away it ends with exit code 5.
    """
    if scheduler == "":
        raise click.BadParameter("the address of the scheduler is empty", param_hint="--scheduler")
    if scheduler and jobs:
        raise click.UsageError("--jobs is about this machine; a scheduler has its own workers")
    config = load_config(configs)
    from camcomp.compensation.batch import pools
    from camcomp.compensation.batch.programs import Plan, find_programs, output_tree
    from camcomp.ground.files import write_all
    from camcomp.ground.shelf import usable

    if config.control.dialect is None:
        list(usable("dialects"))  # says which plug-ins are left out; workers would say it once each
    plan = Plan(
        config, Path(output_dir), method or config.compensation.method,
        tolerance_um or config.compensation.tolerance_um, joints, __version__,
    )  # fmt: skip
    programs = find_programs(paths, plan.output)
    if scheduler:
        pool = partial(pools.on_a_cluster, address=scheduler, tell=partial(say, quiet=False))
    else:
        pool = partial(pools.on_this_machine, jobs=min(jobs or pools.cores(), len(programs)))
    statuses: list[Status] = []
    findings = [each for each in (sarif_file, junit_file) if each is not None]
    with output_tree(plan, programs, [str(plan.output / SUMMARY), *findings]):
        try:
            _work(plan, programs, pool, statuses, quiet)
        except CamcompError as error:
            _note_down(plan, statuses, programs, error.exit_code)
            raise
        except BaseException:
            _note_down(plan, statuses, programs, INTERRUPTED)
            raise
        figures = _note_down(plan, statuses, programs, 0)
        cases = [_case(each) for each in sorted(statuses, key=lambda each: each.source)]
        write_all(findings_files("batch", cases, sarif_file=sarif_file, junit_file=junit_file))
    counts = ", ".join(f"{count} {name}" for name, count in figures["counts"].items() if count)
    say(f"{figures['programs']} programs: {counts}", quiet=quiet)
    out: int = figures["exit_code"]
    return out


def _work(
    plan: Plan, programs: Sequence[FoundProgram], pool: Callable[[Iterable[Task]], Iterator[Outcome]],
    statuses: list[Status], quiet: bool,
) -> None:  # fmt: skip
    from camcomp.compensation.batch.programs import run_batch

    for status in run_batch(plan, programs, pool):
        statuses.append(status)
        if not quiet or status.exit_code:
            _tell(status, len(statuses), len(programs))


def _note_down(
    plan: Plan, statuses: Sequence[Status], programs: Sequence[FoundProgram], stopped: int
) -> dict[str, Any]:
    """Writes what became of every program so far; the figures."""
    from camcomp.compensation.batch.programs import summary
    from camcomp.ground.files import write_all

    figures = summary(statuses, programs, stopped)
    write_all({plan.output / SUMMARY: (json.dumps(figures, indent=2) + "\n").encode()})
    return figures


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
