"""Worker processes for a batch: those of this machine, or a Dask cluster that is already running.

Both give outcomes as they come, each task once. A worker that dies takes its task with it; the task is given to another,
and only a task that brings down worker after worker is given up.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Any

from camcomp.compensation.batch.worker import BUG, Outcome, Task, work
from camcomp.ground.errors import ConfigError, FileError

DEATHS = 3  # workers that a task may bring down before it is given up


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def on_this_machine(tasks: Iterable[Task], jobs: int) -> Iterator[Outcome]:
    """Outcomes of tasks done by `jobs` processes of one core each; tasks are taken from the iterable when needed."""
    if jobs == 1:
        yield from map(work, tasks)
        return
    from joblib import Parallel, delayed
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    source = iter(tasks)
    open_tasks: dict[str, Task] = {}

    def taken() -> Iterator[Any]:
        for task in source:
            open_tasks[task.key] = task
            yield delayed(work)(task)

    def run(calls: Iterable[Any], jobs: int) -> Iterator[Outcome]:
        pool = Parallel(
            n_jobs=jobs, backend="loky", return_as="generator_unordered", batch_size=1, pre_dispatch=2 * jobs
        )
        for outcome in pool(calls):
            open_tasks.pop(outcome.key)
            yield outcome

    for _ in range(DEATHS):
        try:
            left = list(open_tasks.values())
            yield from run([delayed(work)(task) for task in left], jobs)
            yield from run(taken(), jobs)
            get_reusable_executor().shutdown(wait=True, kill_workers=True)  # nothing is left to do: no farewells
            return
        except TerminatedWorkerError:
            continue
    for task in [*open_tasks.values(), *source]:  # one by one: now it shows which task brings workers down
        open_tasks[task.key] = task
        try:
            yield from run([delayed(work)(task)], 2)
        except TerminatedWorkerError:
            open_tasks.pop(task.key)
            yield died(task.key)


def died(key: str) -> Outcome:
    """Outcome of a task that brought its workers down."""
    text = "the worker process died, perhaps for lack of memory"
    return Outcome(key, BUG, [{"rule": None, "message": text, "text": f"internal error: {text}"}])


def on_a_cluster(tasks: Iterable[Task], address: str) -> Iterator[Outcome]:
    """Outcomes of tasks done by the workers of a Dask scheduler at `address` (tcp://host:port).

    Programs and configuration travel with the tasks, and results come back, so that no common disk is needed. Raises
    ConfigError CC216 when Dask is not installed, FileError CC503 when nobody answers.
    """
    try:
        from distributed import Client
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        raise ConfigError(
            "CC216", "a Dask cluster needs the package distributed", hint="pip install 'camcomp[cluster]'"
        ) from error
    try:
        client = Client(address, timeout=10)
    except (OSError, ValueError) as error:
        raise FileError("CC503", f"no Dask scheduler answers at {address}: {error}") from error
    source = iter(tasks)
    open_futures: dict[Any, str] = {}

    def submit(count: int) -> Sequence[Any]:
        fresh = []
        for task in islice(source, count):
            future = client.submit(work, task, key=f"camcomp-{task.key}", pure=True, retries=0)
            open_futures[future] = task.key
            fresh.append(future)
        return fresh

    from distributed import as_completed

    with client:
        window = 4 * max(1, len(client.scheduler_info(n_workers=-1)["workers"]))
        waiting = as_completed(submit(window))
        for future in waiting:
            key = open_futures.pop(future)
            try:
                outcome = future.result()
            except KilledWorker:
                outcome = died(key)
            future.release()
            for fresh in submit(1):
                waiting.add(fresh)
            yield outcome
