"""Worker processes for a batch: those of this machine, or a Dask cluster that is already running.

Both give outcomes as they come, each task once. A worker that dies takes its task with it; the task is given to another,
and is given up if that dies, too.
"""

from __future__ import annotations

import asyncio
import logging
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from functools import partial
from itertools import islice
from types import ModuleType
from typing import Any

from camcomp import __version__
from camcomp.compensation.batch.worker import BUG, Outcome, Task, failed, live_with_parent, work
from camcomp.ground.errors import ConfigError, FileError
from camcomp.ground.machine_code import ROOT
from camcomp.ground.notes import note

DIED = "the worker process died, perhaps for lack of memory"
CONNECT = 10.0  # s within which a scheduler has to answer
LOOK = 1.0  # s between two looks at workers from which nothing comes
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
    source, open_tasks, ended = iter(tasks), dict[str, Task](), False
    while not ended:
        with suppress(BrokenProcessPool):
            yield from _on_workers(source, open_tasks, jobs)
            ended = True
        for task in list(open_tasks.values()):  # one by one: so it shows which of them brings workers down
            try:
                yield from _on_workers(iter([task]), open_tasks, 1)
            except BrokenProcessPool:
                del open_tasks[task.key]
                yield failed(task.key, BUG, DIED, where="internal error: ")


def _on_workers(tasks: Iterator[Task], open_tasks: dict[str, Task], jobs: int) -> Iterator[Outcome]:
    """Outcomes by one set of workers; open_tasks: those without an outcome. Raises BrokenProcessPool."""
    pool = ProcessPoolExecutor(
        jobs, multiprocessing.get_context("forkserver" if FORKS else "spawn"), initializer=live_with_parent
    )
    others = set(multiprocessing.active_children())

    def submit(task: Task) -> Future[Outcome]:
        open_tasks[task.key] = task
        with clean_children():
            return pool.submit(work, task)

    try:
        for outcome in _outcomes(tasks, submit, 2 * jobs):
            del open_tasks[outcome.key]
            yield outcome
    except BaseException:
        for process in set(multiprocessing.active_children()) - others:
            process.kill()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _outcomes(
    tasks: Iterator[Task], submit: Callable[[Task], Future[Outcome]], count: int, *,
    outcome_of: Callable[[Future[Outcome], str], Outcome] = lambda future, _key: future.result(),
    look: Callable[[], object] = lambda: None,
) -> Iterator[Outcome]:  # fmt: skip
    """Outcomes as they come, with `count` tasks submitted at once; look: called where none has come for LOOK seconds."""
    waiting = {submit(task): task.key for task in islice(tasks, count)}
    while waiting:
        found = wait(waiting, timeout=LOOK, return_when=FIRST_COMPLETED).done
        if not found:
            look()
        for future in found:
            outcome = outcome_of(future, waiting.pop(future))
            waiting |= {submit(task): task.key for task in islice(tasks, 1)}
            for topic, text in outcome.notes.items():
                note(topic, text)
            yield outcome


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
    cluster, submit = _Cluster(client, address, tell), partial(client.get_executor(pure=True, retries=0).submit, work)
    try:
        count = 4 * max(1, cluster.look())
        yield from _outcomes(iter(tasks), submit, count, outcome_of=cluster.outcome, look=cluster.look)
    finally:
        with suppress(Exception):  # the scheduler may be gone
            client.close(timeout=2)


class _Cluster:
    """A scheduler with whatever workers it has."""

    def __init__(self, client: Any, address: str, tell: Callable[[str], None]) -> None:
        self._client, self._address, self._tell = client, address, tell
        self._fitting: set[str] = set()
        self._alone_since: float | None = time.monotonic()

    def outcome(self, future: Future[Outcome], key: str) -> Outcome:
        """The outcome of a task that has ended. Raises FileError."""
        from distributed.scheduler import KilledWorker

        try:
            outcome = future.result()
        except KilledWorker:
            return failed(key, BUG, DIED, where="internal error: ")
        except (CancelledError, asyncio.CancelledError, OSError) as error:  # only a scheduler that goes away cancels
            raise self._gone() from error
        except Exception as error:  # noqa: BLE001 - the cluster's, not the task's: `work` never raises
            self.look()
            text = f"the cluster did not do it: {type(error).__name__}: {error}"
            return failed(key, FileError.exit_code, text, rule="CC503")
        self._check_version("a worker", outcome.version)
        return outcome

    def look(self) -> int:
        """How many workers there are. Says once after PATIENCE that there is none. Raises FileError."""
        if self._client.status != "running":
            raise self._gone()
        workers = set(self._client.scheduler_info(n_workers=-1)["workers"])
        if new := list(workers - self._fitting):
            with suppress(OSError, CancelledError, asyncio.CancelledError):  # gone meanwhile; the next look tells
                # A function of camcomp's own would have to be known to whatever version is there.
                ask = "__import__('camcomp').__version__"
                for worker, version in self._client.run(eval, ask, workers=new, on_error="return").items():
                    if not isinstance(version, OSError):
                        self._check_version(worker, version)
                        self._fitting.add(worker)
        if workers:
            self._alone_since = time.monotonic()
        elif self._alone_since is not None and time.monotonic() - self._alone_since > PATIENCE:
            self._tell(f"the Dask scheduler at {self._address} has no workers; waiting for one")
            self._alone_since = None
        return len(workers)

    def _gone(self) -> FileError:
        return FileError("CC503", f"the Dask scheduler at {self._address} went away")

    def _check_version(self, worker: str, version: object) -> None:
        if version != __version__:
            have = f"camcomp {version}" if isinstance(version, str) else f"no camcomp that can be used ({version})"
            raise FileError("CC505", f"{worker} has {have}, this is {__version__}")
