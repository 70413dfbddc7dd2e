"""Worker processes for a batch: those of this machine, or a Dask cluster that is already running.

Both give outcomes as they come, each task once. A worker that dies takes its task with it; the task is given to another,
and only a task that brings down worker after worker is given up.
"""

from __future__ import annotations

import asyncio
import logging
import os
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from itertools import islice
from queue import Empty, Queue
from typing import Any

from camcomp import __version__
from camcomp.compensation.batch.worker import BUG, Outcome, Task, live_with, work
from camcomp.ground.errors import ConfigError, FileError
from camcomp.ground.notes import note

DEATHS = 3  # workers that a task may bring down before it is given up
CONNECT = 10.0  # s within which a scheduler has to answer
LOOK = 1.0  # s between two looks at a cluster in which nothing happens
PATIENCE = 5.0  # s without a worker before a word is said about it


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def safe_children() -> Iterator[None]:
    """Child processes started within it import no module from the current folder.

    Python puts that folder in front of its own modules for `python -m` and `python -c`, by which workers start.
    """
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        if before is None:
            os.environ.pop("PYTHONSAFEPATH", None)
        else:
            os.environ["PYTHONSAFEPATH"] = before


def on_this_machine(tasks: Iterable[Task], jobs: int) -> Iterator[Outcome]:
    """Outcomes of tasks done by `jobs` processes of one core each; tasks are taken from the iterable when needed."""
    if jobs == 1:
        yield from map(work, tasks)
        return
    with safe_children():
        yield from _on_workers(tasks, jobs)


def _on_workers(tasks: Iterable[Task], jobs: int) -> Iterator[Outcome]:
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
            n_jobs=jobs, backend="loky", return_as="generator_unordered", batch_size=1, pre_dispatch=2 * jobs,
            initializer=live_with, initargs=(os.getpid(),),
        )  # fmt: skip
        for outcome in pool(calls):
            open_tasks.pop(outcome.key)
            for topic, text in outcome.notes.items():
                note(topic, text)
            yield outcome

    for _ in range(DEATHS):
        try:
            left = list(open_tasks.values())
            yield from run([delayed(work)(task) for task in left], jobs)
            yield from run(taken(), jobs)
            get_reusable_executor().shutdown(wait=True, kill_workers=True)  # all tasks are done
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
    return Outcome(
        key=key, exit_code=BUG, messages=[{"rule": None, "message": text, "text": f"internal error: {text}"}]
    )


def on_a_cluster(tasks: Iterable[Task], address: str, tell: Callable[[str], None] = print) -> Iterator[Outcome]:
    """Outcomes of tasks done by the workers of a Dask scheduler at `address` (tcp://host:port).

    Programs and configuration travel with the tasks, and results come back, so that no common disk is needed. tell: takes
    a line for the user; without a worker it is used after PATIENCE, and the tasks wait. Raises ConfigError CC216 when Dask
    is not installed, FileError CC503 when the scheduler does not answer or goes away, CC505 when a worker has another
    camcomp.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise ConfigError(
            "CC216", "a Dask cluster needs the package distributed", hint="pip install 'camcomp[cluster]'"
        ) from error
    logging.disable(logging.CRITICAL)  # tracebacks of lost connections; what matters of them is said here
    try:
        client = Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise FileError("CC503", f"no Dask scheduler answers at {address}: {error}") from error
    try:
        yield from _Cluster(client, address, tell).outcomes(iter(tasks))
    finally:
        with suppress(Exception):  # the scheduler may be gone
            client.close(timeout=2)


class _Cluster:
    """A scheduler with whatever workers it has."""

    def __init__(self, client: Any, address: str, tell: Callable[[str], None]) -> None:
        self._client, self._address, self._tell = client, address, tell
        self._done: Queue[Any] = Queue()
        self._open: dict[Any, str] = {}
        self._fitting: set[str] = set()
        self._alone_since: float | None = time.monotonic()
        self._told = False

    def outcomes(self, tasks: Iterator[Task]) -> Iterator[Outcome]:
        """Each task's outcome, as it comes."""
        self._submit(tasks, 4 * max(1, len(self._workers())))
        while self._open:
            try:
                future = self._done.get(timeout=LOOK)
            except Empty:
                self._workers()
                continue
            outcome = self._outcome(future, self._open.pop(future))
            future.release()
            self._submit(tasks, 1)
            yield outcome

    def _submit(self, tasks: Iterator[Task], count: int) -> None:
        for task in islice(tasks, count):
            future = self._client.submit(work, task, key=f"camcomp-{task.key}", pure=True, retries=0)
            self._open[future] = task.key
            future.add_done_callback(self._done.put)

    def _outcome(self, future: Any, key: str) -> Outcome:
        from distributed.scheduler import KilledWorker

        try:
            outcome: Outcome = future.result(timeout=LOOK)
        except KilledWorker:
            return died(key)
        except (
            CancelledError,
            asyncio.CancelledError,
            OSError,
        ) as error:  # only the scheduler cancels, when it goes away
            raise self._gone() from error
        except Exception as error:  # noqa: BLE001 - the cluster's, not the task's: `work` never raises
            self._workers()
            text = f"the cluster did not do it: {type(error).__name__}: {error}"
            return Outcome(
                key=key, exit_code=FileError.exit_code, messages=[{"rule": "CC503", "message": text, "text": text}]
            )
        if outcome.version != __version__:
            self._refuse("a worker", outcome.version)
        return outcome

    def _workers(self) -> list[str]:
        """Addresses of the workers that there are. Says after PATIENCE that there is none. Raises FileError."""
        if self._client.status != "running":
            raise self._gone()
        workers = list(self._client.scheduler_info(n_workers=-1)["workers"])
        self._check_versions([each for each in workers if each not in self._fitting])
        if workers:
            self._alone_since, self._told = None, False
        elif self._alone_since is None:
            self._alone_since = time.monotonic()
        elif time.monotonic() - self._alone_since > PATIENCE and not self._told:
            self._tell(f"the Dask scheduler at {self._address} has no workers; waiting for one")
            self._told = True
        return workers

    def _gone(self) -> FileError:
        return FileError("CC503", f"the Dask scheduler at {self._address} went away")

    def _check_versions(self, workers: Sequence[str]) -> None:
        if not workers:
            return
        # A function of camcomp's own would have to be known to whatever version is there.
        ask = "__import__('camcomp').__version__"
        try:
            found = self._client.run(eval, ask, workers=list(workers), on_error="return")
        except (OSError, CancelledError, asyncio.CancelledError):
            return  # gone meanwhile; the next look tells
        for worker, version in found.items():
            if isinstance(version, OSError):
                continue
            if version != __version__:
                self._refuse(worker, version)
            self._fitting.add(worker)

    def _refuse(self, worker: str, version: object) -> None:
        have = f"camcomp {version}" if isinstance(version, str) else f"no camcomp that can be used ({version})"
        raise FileError("CC505", f"{worker} has {have}, this is {__version__}")
