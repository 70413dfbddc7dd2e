"""What people see while camcomp works: standard error, and moving text only on a terminal."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

PATIENCE = 1.0  # s before a work in progress is worth a word
TICK = 0.5  # s


def lively() -> bool:
    """Whether standard error is a terminal that can draw a line anew."""
    return sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


@contextmanager
def working(on: str, *, quiet: bool = False) -> Iterator[None]:
    """Say after a moment what is being worked on, and for how long; nothing is left of it afterwards."""
    if quiet or not lively():
        yield
        return
    stream, done, start = sys.stderr, threading.Event(), time.monotonic()

    def tell() -> None:
        pause = PATIENCE
        while not done.wait(pause):
            stream.write(f"\r\033[K{on} ... {time.monotonic() - start:.0f} s")
            stream.flush()
            pause = TICK

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield
    finally:
        done.set()
        teller.join()
        stream.write("\r\033[K")
        stream.flush()


def say(*lines: str, quiet: bool = False) -> None:
    """Write lines to standard error, unless quiet."""
    if not quiet:
        print("\n".join(lines), file=sys.stderr)
