"""Progress of long work: the work reports its share, and a watcher may display it.

The reported share never decreases: it is constant while work is repeated.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from camcomp.ground.records import dataclass

T = TypeVar("T")
COMPILING, ONCE = "compiling", "compiling, once per installation"


@dataclass
class Progress:
    """Progress of the work in a context.

    share: 0 to 1, None before the first report. doing: text of a step that delays the work, or empty. span: interval of the
    whole that the present part covers; points: the part consists of solved points.
    """

    share: float | None = None
    doing: str = ""
    span: tuple[float, float] = (0.0, 1.0)
    points: bool = False


_watched: list[Progress] = []  # innermost last


@contextmanager
def watched() -> Iterator[Progress]:
    """Context whose progress can be read from the yielded object."""
    progress = Progress()
    _watched.append(progress)
    try:
        yield progress
    finally:
        _watched.pop()


def done(share: float) -> None:
    """Report the share of the present part, 0 to 1."""
    if _watched:
        progress = _watched[-1]
        low, high = progress.span
        progress.share = max(progress.share or 0.0, low + min(max(share, 0.0), 1.0) * (high - low))


@contextmanager
def part(low: float, high: float, *, points: bool = False) -> Iterator[None]:
    """Context that maps reported shares to the interval low to high of the surrounding part.

    points: the part consists of solved points, whose number is the share.
    """
    progress = _watched[-1] if _watched else Progress()
    before = progress.span, progress.points
    start, whole = before[0][0], before[0][1] - before[0][0]
    progress.span, progress.points = (start + low * whole, start + high * whole), points
    try:
        yield
        done(1.0)
    finally:
        progress.span, progress.points = before


def steps(items: Iterable[T], count: int) -> Iterator[T]:
    """Iterate over `count` items, each an equal part of the present part."""
    for k, each in enumerate(items):
        with part(k / count, (k + 1) / count):
            yield each


def points(items: Iterable[T], count: int) -> Iterator[T]:
    """Iterate over `count` pieces of points, and report them if the present part consists of points."""
    counting = bool(_watched) and _watched[-1].points
    for k, each in enumerate(items):
        yield each
        if counting:
            done((k + 1) / count)


def hold(what: str) -> None:
    """Report a step that delays the work from now on; empty: the delay is over."""
    if _watched:
        _watched[-1].doing = what
