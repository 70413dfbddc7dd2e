"""What keeps to a clock runs alone: the other processes of a test run wait for it, and it for them.

Commands that tests start are ended by signals as in a shell, also where the test run was started by nohup or in the background.
"""

import fcntl
import gc
import hashlib
import os
import signal
import tempfile
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest


def pytest_configure():
    """Signals that are ignored here are ignored by every command that a test starts; handled ones are not.

    Garbage is collected less often: fixtures keep much, which would be looked through again and again.
    """
    gc.set_threshold(50_000, 20, 20)
    for number in (signal.SIGINT, signal.SIGHUP):
        if signal.getsignal(number) == signal.SIG_IGN:
            signal.signal(number, lambda *_: None)


@contextmanager
def locked(path, kind):
    """A lock on a file; shared ones of several processes go together."""
    with open(path, "a", encoding="utf-8") as file:
        fcntl.flock(file, kind)
        yield


def turns():
    """A folder that all processes which test this checkout share; it does not hang on pytest's cache."""
    checkout = hashlib.sha256(str(Path(__file__).parents[1]).encode()).hexdigest()[:16]
    folder = Path(tempfile.gettempdir()) / f"camcomp-turns-{os.getuid()}-{checkout}"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session", autouse=True)
def sample_experiments_are_diagnosed_once():
    """The diagnosis of a sample experiment, kept per process for the same files."""
    from camcomp.api import diagnosis as api
    from camcomp.diagnosis import diagnose as module

    whole, judge, found = api._diagnosed, module.diagnose, {}

    def diagnosed(experiment, *how):
        with pytest.MonkeyPatch.context() as patch:
            if "samples/diagnosis" in Path(experiment).resolve().as_posix():
                patch.setattr(module, "diagnose", once)
            return whole(experiment, *how)

    def once(job, twin, runs, **how):
        key = (
            job.config.model_dump_json(),
            repr(how),
            *(v.tobytes() for run in runs for v in vars(run.measured).values()),
        )
        if key not in found:
            found[key] = judge(job, twin, runs, **how)
        return found[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(api, "_diagnosed", diagnosed)
        yield


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Takes a shared turn for every test, one of its own for those marked `alone`, fixtures included."""
    folder = turns()
    kind = fcntl.LOCK_EX if item.get_closest_marker("alone") else fcntl.LOCK_SH
    with ExitStack() as turn:
        with locked(folder / "door", kind):  # who waits for a turn of its own shuts it behind those that have one
            turn.enter_context(locked(folder / "turn", kind))
        return (yield)
