"""Display of progress on standard error; a line is redrawn on terminals only."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click

from camcomp.ground.errors import shown
from camcomp.ground.headway import Headway, watched

PATIENCE = 1.0  # s before the progress is shown
TICK = 0.5  # s
FILTER = "AXIS_PROGRESS_BAR"  # set by LinuxCNC's AXIS for its filters
STEPS = 1000  # of a bar
WIDE = 24  # characters of a bar


def lively() -> bool:
    """Whether standard error is a terminal that can redraw a line."""
    return sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


@contextmanager
def working(on: str, *, quiet: bool = False) -> Iterator[None]:
    """Context that shows the input, the share done and the remaining time, or else the elapsed time, after PATIENCE.

    The line is erased at the end.
    """
    if FILTER in os.environ:
        with _filter_progress():
            yield
        return
    if quiet or not lively():
        yield
        return
    stream, finished = sys.stderr, threading.Event()

    def tell(headway: Headway) -> None:
        line, pause = _Line(on), PATIENCE
        while not finished.wait(pause):
            stream.write(f"\r\033[K{line.text(headway)}")
            stream.flush()
            pause = TICK

    with watched() as headway:
        teller = threading.Thread(target=tell, args=(headway,), daemon=True)
        teller.start()
        try:
            yield
        finally:
            finished.set()
            teller.join()
            stream.write("\r\033[K")
            stream.flush()


@contextmanager
def _filter_progress() -> Iterator[None]:
    """Lines `FILTER_PROGRESS=share` in percent, from which AXIS draws the bar of a filter program."""
    finished = threading.Event()

    def tell(headway: Headway) -> None:
        while not finished.wait(TICK):
            print(f"FILTER_PROGRESS={round(100.0 * (headway.share or 0.0))}", file=sys.stderr, flush=True)

    with watched() as headway:
        teller = threading.Thread(target=tell, args=(headway,), daemon=True)
        teller.start()
        try:
            yield
        finally:
            finished.set()
            teller.join()
            print("FILTER_PROGRESS=100", file=sys.stderr, flush=True)


class _Line:
    """The redrawn line: a bar with share and remaining time, or the elapsed time."""

    def __init__(self, on: str) -> None:
        self._on, self._start = shown(on), time.monotonic()
        bar: Any = click.progressbar(
            length=STEPS,
            label=self._on,
            width=WIDE,
            show_percent=True,
            show_eta=True,
            file=sys.stderr,
            fill_char="=",
            empty_char=" ",
        )
        self._bar = bar

    def text(self, headway: Headway) -> str:
        spent = time.monotonic() - self._start
        if headway.doing or headway.share is None:
            return f"{self._on} ... {headway.doing + ', ' if headway.doing else ''}{spent:.0f} s"
        self._bar.make_step(round(headway.share * STEPS) - self._bar.pos)
        left = " left" if self._bar.eta_known and not self._bar.finished else ""
        return f"{self._bar.format_progress_line()}{left}"


def say(*lines: str, quiet: bool = False) -> None:
    """Write lines to standard error, unless quiet."""
    if lines and not quiet:
        print(shown("\n".join(lines)), file=sys.stderr)
