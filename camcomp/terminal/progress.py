"""Display of progress on standard error; a line is redrawn on terminals only."""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from typing import Any

import click

from camcomp.ground.errors import shown
from camcomp.ground.progress import Progress, watched

PATIENCE = 1.0  # s before the progress is shown
TICK = 0.5  # s
SELDOM = 10.0  # s between lines where nothing can be drawn anew
WIPE = "\r\033[K"
FILTER = "AXIS_PROGRESS_BAR"  # set by LinuxCNC's AXIS for its filters
STEPS = 1000  # of a bar
WIDE = 24  # characters of a bar
_drawing: list[bool] = []  # whether the works in progress, innermost last, draw a line anew


def lively() -> bool:
    """Whether standard error is a terminal that can redraw a line."""
    return sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


@contextmanager
def working(on: str, *, quiet: bool = False) -> Iterator[None]:
    """Show the work in progress, its done share and the expected remaining time; where that is unknown, the time so far.

    On a terminal a line is drawn anew after a moment, and wiped at the end. Elsewhere a line is written every 10 s, so that
    logs of CI jobs and services show it. LinuxCNC's AXIS gets the lines that it asks of filters.
    """
    tell: AbstractContextManager[None]
    if FILTER in os.environ:
        tell = _telling(lambda progress: f"FILTER_PROGRESS={round(100.0 * (progress.share or 0.0))}\n", (TICK, TICK))
        end = "FILTER_PROGRESS=100\n"
    elif quiet:
        tell, end = nullcontext(), ""
    elif lively():
        line = _Line(on)
        tell, end = _telling(lambda progress: f"{WIPE}{line.text(progress)}", (PATIENCE, TICK)), WIPE
    else:
        spoken, began = shown(on), time.monotonic()
        tell, end = _telling(lambda progress: f"{_spoken(spoken, began, progress)}\n", (SELDOM, SELDOM)), ""
    _drawing.append(end == WIPE)
    try:
        with tell:
            yield
    finally:
        _drawing.pop()
        if end:
            print(end, end="", file=sys.stderr, flush=True)


@contextmanager
def _telling(text: Callable[[Progress], str], pauses: tuple[float, float]) -> Iterator[None]:
    """Write texts to standard error from another thread, the first after pauses[0] s, further ones pauses[1] s apart."""
    stream, finished = sys.stderr, threading.Event()

    def tell(progress: Progress) -> None:
        pause, later = pauses
        while not finished.wait(pause):
            with suppress(OSError):
                stream.write(text(progress))
                stream.flush()
            pause = later

    with watched() as progress:
        teller = threading.Thread(target=tell, args=(progress,), daemon=True)
        teller.start()
        try:
            yield
        finally:
            finished.set()
            teller.join()


def _spoken(on: str, began: float, progress: Progress) -> str:
    """One line of a log: share and remaining time, or what is known instead."""
    spent = time.monotonic() - began
    if progress.doing or not progress.share:
        return f"{on}: {progress.doing + ', ' if progress.doing else ''}{_duration(spent)} so far"
    rest = spent * (1.0 - progress.share) / progress.share
    return f"{on}: {100.0 * progress.share:.0f} %, about {_duration(rest)} left"


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


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

    def text(self, progress: Progress) -> str:
        spent = time.monotonic() - self._start
        if progress.doing or progress.share is None:
            return f"{self._on} ... {progress.doing + ', ' if progress.doing else ''}{spent:.0f} s"
        self._bar.make_step(round(progress.share * STEPS) - self._bar.pos)
        left = " left" if self._bar.eta_known and not self._bar.finished else ""
        return f"{self._bar.format_progress_line()}{left}"


def say(*lines: str, quiet: bool = False) -> None:
    """Write lines to standard error, unless quiet; a line that is being drawn there makes room."""
    if lines and not quiet:
        if any(_drawing):
            print(WIPE, end="", file=sys.stderr)
        print(shown("\n".join(lines)), file=sys.stderr)
