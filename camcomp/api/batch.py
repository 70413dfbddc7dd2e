"""Compensation of many programs in parallel, on this machine or on a cluster; an interrupted batch is resumed."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal

from camcomp import __version__
from camcomp.compensation.batch import pools
from camcomp.compensation.batch.programs import (
    DONE,
    ERROR,
    FoundProgram,
    Status,
    find_programs,
    output_tree,
    run_batch,
    summary,
)
from camcomp.compensation.batch.worker import Outcome, Plan, Task
from camcomp.ground.errors import CamcompError, CheckFailed
from camcomp.ground.files import write_all
from camcomp.ground.shelf import usable
from camcomp.model.config.load import load_config
from camcomp.model.from_program import StockChoice
from camcomp.report.findings import Case, findings_of_messages
from camcomp.report.outputs import findings_files

__all__ = ["DONE", "ERROR", "Status", "compensate_many"]

SUMMARY = "camcomp-batch.json"
INTERRUPTED = 130  # exit code in the summary of a batch ended by a signal or a bug
OnStatus = Callable[[Status, int, int], Any]


def compensate_many(
    paths: Sequence[str], configs: Sequence[str], output_dir: str, *, jobs: int | None = None, scheduler: str | None = None,
    joints: bool = False, method: str | None = None, tolerance_um: float | None = None, stock: StockChoice | None = None, if_compensated: Literal["refuse", "pass"] = "refuse", sarif_file: str | None = None,
    junit_file: str | None = None, tell: Callable[[str], None] = lambda _text: None, on_status: OnStatus = lambda *_: None,
) -> dict[str, Any]:  # fmt: skip
    """Compensate the programs of files, folders and patterns into a tree, and return the figures of DIR/camcomp-batch.json.

    on_status: called with the status of a finished program, its number and the number of programs. tell: called with
    messages while the batch waits for a cluster. Raises errors of the whole batch; those of single programs are in its
    figures.
    """
    if not scheduler and jobs != 1:
        pools.start_early()
    config = load_config(configs)
    if config.control.dialect is None:
        list(usable("dialects"))  # warns about unusable plug-ins here, instead of once per worker
    plan = Plan(
        config=config,
        output=Path(output_dir),
        method=method or config.compensation.method,
        tolerance_um=tolerance_um or config.compensation.tolerance_um,
        joints=joints,
        version=__version__,
        stock=stock,
        passes=if_compensated == "pass",
    )
    programs = find_programs(paths, plan.output)
    if scheduler:
        pool = partial(pools.on_a_cluster, address=scheduler, tell=tell)
    else:
        pool = partial(pools.on_this_machine, jobs=min(jobs or pools.cores(), len(programs)))
    statuses: list[Status] = []
    findings = [each for each in (sarif_file, junit_file) if each is not None]
    with output_tree(plan, programs, [str(plan.output / SUMMARY), *findings]):
        try:
            _work(plan, programs, pool, statuses, on_status)
        except CamcompError as error:
            _note_down(plan, statuses, programs, error.exit_code)
            raise
        except BaseException:
            _note_down(plan, statuses, programs, INTERRUPTED)
            raise
        figures = _note_down(plan, statuses, programs, 0)
        cases = [_case(each) for each in sorted(statuses, key=lambda each: each.source)]
        write_all(findings_files("batch", cases, sarif_file=sarif_file, junit_file=junit_file))
    return figures


def _work(
    plan: Plan, programs: Sequence[FoundProgram], pool: Callable[[Iterable[Task]], Iterator[Outcome]],
    statuses: list[Status], on_status: OnStatus,
) -> None:  # fmt: skip
    for status in run_batch(plan, programs, pool):
        statuses.append(status)
        on_status(status, len(statuses), len(programs))


def _note_down(
    plan: Plan, statuses: Sequence[Status], programs: Sequence[FoundProgram], stopped: int
) -> dict[str, Any]:
    """Write the status of every program so far, and return the figures of the batch."""
    figures = summary(statuses, programs, stopped)
    write_all({plan.output / SUMMARY: (json.dumps(figures, indent=2) + "\n").encode()})
    return figures


def _case(status: Status) -> Case:
    check = status.exit_code == CheckFailed.exit_code
    findings = findings_of_messages(status.messages, status.source, check=check)
    return Case(status.source, findings, status.status)
