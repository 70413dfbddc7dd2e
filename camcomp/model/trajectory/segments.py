"""Segments of a controller: consecutive lines that are straight within the tolerance of their path mode become one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.gcode.path_mode import PathMode
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, LINE, Bools, Floats, Ints, Path
from camcomp.ground.records import dataclass, replace
from camcomp.model.trajectory.merging import merge, straight
from camcomp.model.trajectory.moves import ToolMoves, moves_of

SHORTEST = 1e-9  # mm; shorter moves are standstills and take no time


@dataclass(frozen=True, eq=False)
class Segments:
    """Moves (n,) as m segments.

    group (n,): segment of every move; first, last (m,): moves of a segment; waits (m,): the controller stops before it.
    """

    group: Ints
    first: Ints
    last: Ints
    waits: Bools


def segments(moves: ToolMoves) -> Segments:
    """Segments of moves (n,); standstills belong to the segment before them."""
    n = len(moves)
    size = np.empty(n)
    straight(*read_only(moves.start, moves.end), size, np.empty((n, 3)), np.empty(n))
    if len(bent := np.flatnonzero(moves.kind == ARC)):
        size[bent] = path_geometry.lengths(moves.take(bent))
    group, first, last = (np.zeros(n, np.int64) for _ in range(3))
    joins = (moves.kind == LINE) & ~moves.exact
    goes = size > SHORTEST
    waits = _beginning_at_rest(moves.waits, goes)
    m = merge(*read_only(moves.start, moves.end), goes, waits, joins, moves.feed, moves.merge, group, first, last)
    return Segments(group, first[:m], last[:m], waits[first[:m]])


def merged(path: Path, modes: Sequence[PathMode]) -> Path | None:
    """Path with lines merged by the controller in path modes (n,), corners sharp; None if all lines stay as they are."""
    if not any(mode.merge_mm > 0.0 for mode in modes):
        return None
    found = segments(moves_of(path, modes))
    if len(found.first) == np.count_nonzero(path_geometry.lengths(path) > SHORTEST):
        return None
    turn = path.orientation
    if turn is not None:
        turn = replace(turn.take(found.last), start=turn.start[found.first])
    return replace(path.take(found.last), start=path.start[found.first], orientation=turn)


def read_only(*points: Floats) -> list[Floats]:
    """Read-only views, like the arrays of paths, so that numba compiles for one kind of array."""
    views = [each.view() for each in points]
    for each in views:
        each.flags.writeable = False
    return views


def _beginning_at_rest(waits: Bools, goes: Bools) -> Bools:
    """Mask (n,) of moves with a length that start from a stop, before them or before the standstills in front of them."""
    out, at = np.zeros(len(waits), np.bool_), np.flatnonzero(goes)
    out[at] = np.diff(np.cumsum(waits)[at], prepend=0) > 0
    return out
