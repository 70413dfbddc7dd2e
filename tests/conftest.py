"""What keeps to a clock runs alone: the other processes of a test run wait for it, and it for them.

Commands that tests start are ended by signals as in a shell, also where the test run was started by nohup or in the background.
"""

import fcntl
import signal
from contextlib import ExitStack, contextmanager

import pytest


def pytest_configure():
    """What is ignored here would be ignored by every command that a test starts; what is handled is not."""
    for number in (signal.SIGINT, signal.SIGHUP):
        if signal.getsignal(number) == signal.SIG_IGN:
            signal.signal(number, lambda *_: None)


@contextmanager
def locked(path, kind):
    """A lock on a file; shared ones of several processes go together."""
    with open(path, "a", encoding="utf-8") as file:
        fcntl.flock(file, kind)
        yield


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Takes a shared turn for every test, one of its own for those marked `alone`, fixtures included."""
    folder = item.config.cache.mkdir("turns")  # the same for all processes that test this checkout
    kind = fcntl.LOCK_EX if item.get_closest_marker("alone") else fcntl.LOCK_SH
    with ExitStack() as turn:
        with locked(folder / "door", kind):  # who waits for a turn of its own shuts it behind those that have one
            turn.enter_context(locked(folder / "turn", kind))
        return (yield)
