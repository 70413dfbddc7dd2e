"""Worker processes for a batch: those of this machine, or a Dask cluster that is already running.

Both give outcomes as they come, each task once. A worker that dies takes its task with it; the task is given to another,
and only a task that brings down worker after worker is given up.
"""

from __future__ import annotations

import asyncio
import logging
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from itertools import islice
from queue import Empty, Queue
from types import ModuleType
from typing import Any

from camcomp import __version__
from camcomp.compensation.batch.worker import BUG, Outcome, Task, failed, live_with_parent, work
from camcomp.ground.errors import ConfigError, FileError
from camcomp.ground.machine_code import ROOT
from camcomp.ground.notes import note

DIED = "the worker process died, perhaps for lack of memory"
DEATHS = 3  # workers that a task may bring down before it is given up
CONNECT = 10.0  # s within which a scheduler has to answer
LOOK = 1.0  # s between two looks at a cluster in which nothing happens
PATIENCE = 5.0  # s without a worker before a word is said about it
FORKS = sys.platform != "win32"
NEEDED = ("camcomp.compensation.batch.worker", "camcomp.compensation.long.program", "camcomp.model.from_program")


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def clean_children() -> Iterator[None]:
    """Child processes started within it have this camcomp, and neither modules of the current folder nor a main program.

    Python puts that folder in front of its own modules for `python -c`, by which workers start.
    """
    before, main = os.environ.copy(), sys.modules["__main__"]
    os.environ["PYTHONSAFEPATH"] = "1"
    if ROOT.name not in ("site-packages", "dist-packages"):  # where Python looks anyway
        os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (str(ROOT), before.get("PYTHONPATH"))))
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main
        for name in ("PYTHONSAFEPATH", "PYTHONPATH"):
            os.environ.pop(name, None)
            os.environ.update({name: before[name]} if name in before else {})


def start_early() -> None:
    """Start the process from which workers fork, with the modules that they need, while this process is busy."""
    if FORKS:
        from multiprocessing.forkserver import ensure_running

        multiprocessing.set_forkserver_preload(list(NEEDED))
        with clean_children():
            ensure_running()


def on_this_machine(tasks: Iterable[Task], jobs: int) -> Iterator[Outcome]:
    """Outcomes of tasks done by `jobs` processes of one core each; tasks are taken from the iterable when needed."""
    if jobs == 1:
        yield from map(work, tasks)
        return
    start_early()
    source = iter(tasks)
    open_tasks: dict[str, Task] = {}
    for _ in range(DEATHS):
        with suppress(BrokenProcessPool):
            yield from _on_workers(iter(list(open_tasks.values())), open_tasks, jobs)
            yield from _on_workers(source, open_tasks, jobs)
            return
    for task in [*open_tasks.values(), *source]:  # one by one: now it shows which task brings workers down
        try:
            yield from _on_workers(iter([task]), open_tasks, 1)
        except BrokenProcessPool:
            open_tasks.pop(task.key)
            yield failed(task.key, BUG, DIED, where="internal error: ")


def _on_workers(tasks: Iterator[Task], open_tasks: dict[str, Task], jobs: int) -> Iterator[Outcome]:
    """Outcomes by one set of workers; open_tasks: those without an outcome. Raises BrokenProcessPool."""
    pool = ProcessPoolExecutor(
        jobs, multiprocessing.get_context("forkserver" if FORKS else "spawn"), initializer=live_with_parent
    )
    others, waiting = set(multiprocessing.active_children()), set[Future[Outcome]]()

    def submit(count: int) -> None:
        for task in islice(tasks, count):
            open_tasks[task.key] = task
            with clean_children():
                waiting.add(pool.submit(work, task))

    try:
        submit(2 * jobs)
        while waiting:
            for each in wait(waiting, return_when=FIRST_COMPLETED).done:
                waiting.remove(each)
                outcome = each.result()
                submit(1)
                open_tasks.pop(outcome.key)
                for topic, text in outcome.notes.items():
                    note(topic, text)
                yield outcome
    except BaseException:
        for process in set(multiprocessing.active_children()) - others:
            process.kill()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


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
            return failed(key, BUG, DIED, where="internal error: ")
        except (
            CancelledError,
            asyncio.CancelledError,
            OSError,
        ) as error:  # only the scheduler cancels, when it goes away
            raise self._gone() from error
        except Exception as error:  # noqa: BLE001 - the cluster's, not the task's: `work` never raises
            self._workers()
            text = f"the cluster did not do it: {type(error).__name__}: {error}"
            return failed(key, FileError.exit_code, text, rule="CC503")
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
