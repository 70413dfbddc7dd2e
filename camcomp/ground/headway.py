"""How far long work has come: stories say it, and whoever watches may show it. Without a watcher nothing happens.

A share never goes back: work that is repeated until it is good enough stands still meanwhile.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

T = TypeVar("T")
COMPILING, ONCE = "compiling", "compiling, once per installation"


@dataclass
class Headway:
    """share: of the work that is done, 0 to 1, None as long as nobody has said. doing: what holds it up, or nothing.

    span: of the whole that the part at work makes up; points: whether points solved are what this part consists of.
    """

    share: float | None = None
    doing: str = ""
    span: tuple[float, float] = (0.0, 1.0)
    points: bool = False


_watched: list[Headway] = []  # innermost last


@contextmanager
def watched() -> Iterator[Headway]:
    """Within it, what is done can be read from what is given."""
    headway = Headway()
    _watched.append(headway)
    try:
        yield headway
    finally:
        _watched.remove(headway)


def done(share: float) -> None:
    """Says that this share of the part at work is done, 0 to 1."""
    if _watched:
        headway = _watched[-1]
        low, high = headway.span
        headway.share = max(headway.share or 0.0, low + min(max(share, 0.0), 1.0) * (high - low))


@contextmanager
def part(low: float, high: float, *, points: bool = False) -> Iterator[None]:
    """Within it, what is done counts as done between these shares of the part around it.

    points: the part consists of points that are solved, so that these count.
    """
    headway = _watched[-1] if _watched else Headway()
    before = headway.span, headway.points
    start, whole = before[0][0], before[0][1] - before[0][0]
    headway.span, headway.points = (start + low * whole, start + high * whole), points
    try:
        yield
        done(1.0)
    finally:
        headway.span, headway.points = before


def steps(items: Iterable[T], count: int) -> Iterator[T]:
    """The items, of which there are `count`; each is a part of the part at work."""
    for k, each in enumerate(items):
        with part(k / count, (k + 1) / count):
            yield each


def points(items: Iterable[T], count: int) -> Iterator[T]:
    """Pieces of points that are solved; they count where the part at work consists of them."""
    counting = bool(_watched) and _watched[-1].points
    for k, each in enumerate(items):
        yield each
        if counting:
            done((k + 1) / count)


def hold(what: str) -> None:
    """Says what holds up the work from now on; nothing, where it goes on."""
    if _watched:
        _watched[-1].doing = what
