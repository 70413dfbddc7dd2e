"""Which moves of a corrected program belong to which piece of the original, and which ones only join pieces.

Under the model that made the program every move ends where it is expected. Under another model it does not; then the course
of the moves tells: those of a piece go along it, and a joining line goes from one side of a point to the other.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from camcomp.compensation.program.moves import Layout
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import RAPID, Floats, Ints, Path
from camcomp.ground.errors import CheckFailed
from camcomp.ground.records import dataclass
from camcomp.ground.vectors import sizes
from camcomp.model.cutting.track import Track

NEAR_MM = 5.0  # a matched end may be this far from where it is expected
SURE_MM = 0.02  # from there the model is another one
WAYS, ENDS = 16, 16  # matches that are followed at once, and ends that each of them tries for a piece
JOINING = 0.5  # what a mm of joining line costs, in mm of a move that does not go along its piece


@dataclass(frozen=True)
class _Way:
    """A match of the first pieces: what it costs, mm, the move behind it, joining lines, and the bounds of each piece."""

    cost: float
    stretch: float  # mm by which its pieces are longer or shorter than expected: whether it is worth following
    at: int
    joins: int
    bounds: tuple[Any, ...] | None  # (bounds of the pieces before, first, last)


@dataclass(frozen=True, eq=False, kw_only=True)
class Matching:
    """A corrected path and the pieces (p,) of the original that its moves have to belong to."""

    path: Path
    track: Track
    expected: Floats  # (p, 3) mm: where the model has every piece end
    reach: Floats  # (p,) mm: how long it is then
    layout: Layout
    stamped: bool  # there may be joining lines

    @cached_property
    def step(self) -> Floats:
        """Lengths (m,) mm of the moves."""
        return path_geometry.lengths(self.path)

    @cached_property
    def _walked(self) -> Floats:
        return np.concatenate(([0.0], np.cumsum(self.step)))

    def match(self, *, foreign: bool) -> tuple[Ints, Ints, int]:
        """Moves [first, last) that belong to every piece (p,), and the number of joining lines.

        foreign: another model put them there. Raises CheckFailed CC604 when the path is not one of these pieces.
        """
        try:
            if not foreign:
                found = self._search(as_expected=True)
                off = sizes(self.path.end[found[1] - 1] - self.expected)
                if off.max(initial=0.0) <= SURE_MM or not self.stamped:
                    return found
        except CheckFailed:
            if not self.stamped:
                raise
        try:
            return self._search(as_expected=False)
        except CheckFailed:
            return self._search(as_expected=True)

    def _search(self, *, as_expected: bool) -> tuple[Ints, Ints, int]:
        """`match` with joining lines where the model has them and every piece as it fits best, or else by the course of the moves.

        By the course the moves go best along their pieces, with joining lines wherever feed lines can join.
        """
        n, moves, step, layout = len(self.track.motion), len(self.path), self.step, self.layout
        feeding = layout.corrected & (self.track.path.kind[self.track.motion] != RAPID)
        joins = (self.path.kind != RAPID) & (step < NEAR_MM)
        ways = [_Way(0.0, 0.0, 0, 0, None)]
        for i in range(n):
            grown: dict[int, _Way] = {}
            room = moves - (n - i - 1)
            leads, trails = [(0, 1) if feeding[i] else (0,)] * 2
            if as_expected:
                leads, trails = ((int(each[i] and self.stamped),) for each in (layout.leading, layout.trailing))
            for way in ways:
                for lead in leads:
                    begin = way.at + lead
                    if begin >= room or (lead and not joins[way.at]):
                        continue
                    for stop, longer in self._ends(i, begin, room, 1 if as_expected else ENDS):
                        cost = way.cost + lead * JOINING * step[way.at]
                        cost += 0.0 if as_expected else self._off_course(i, begin, stop)
                        for trail in trails:
                            if trail and not (stop + 1 < room and joins[stop + 1]):
                                continue
                            total = cost + (JOINING * step[stop + 1] if trail else 0.0)
                            behind = stop + 1 + trail
                            if behind not in grown or total < grown[behind].cost:
                                count, stretch = way.joins + lead + trail, way.stretch + longer
                                grown[behind] = _Way(total, stretch, behind, count, (way.bounds, begin, stop + 1))
            if not grown:
                line = int(self.track.path.line[self.track.motion[i]])
                raise CheckFailed("CC604", f"no moves that cut line {line} of the original are found")
            ways = sorted(grown.values(), key=lambda each: each.cost + each.stretch)[:WAYS]
        whole = [way for way in ways if way.at == moves]
        if not whole:
            left = moves - max(way.at for way in ways)
            raise CheckFailed("CC604", f"{left} moves at the end have no counterpart in the original")
        best = min(whole, key=lambda each: each.cost)
        first, last, bounds = np.zeros(n, np.int64), np.zeros(n, np.int64), best.bounds
        for i in range(n - 1, -1, -1):
            assert bounds is not None
            bounds, first[i], last[i] = bounds
        return first, last, best.joins

    def _ends(self, i: int, begin: int, room: int, most: int) -> list[tuple[int, float]]:
        """Last moves that piece i may have if it begins with move `begin`, the likeliest first, and the stretch of each, mm."""
        track, walked = self.track, self._walked
        limit = 1.3 * max(track.length[i], self.reach[i]) + NEAR_MM  # of the moves of a piece together
        stop = min(max(int(np.searchsorted(walked, walked[begin] + limit, side="right")) - 1, begin + 1), room)
        run = walked[begin + 1 : stop + 1] - walked[begin]
        longer = np.minimum(np.abs(run - track.length[i]), np.abs(run - self.reach[i]))
        off = sizes(self.path.end[begin:stop] - self.expected[i]) + 0.1 * longer
        near = np.argsort(off, kind="stable")[:most]
        return [(begin + int(k), float(longer[k])) for k in near if off[k] <= NEAR_MM + 0.1 * limit]

    def _off_course(self, i: int, begin: int, stop: int) -> float:
        """By how much (mm) moves `begin` to `stop` go elsewhere than along piece i."""
        walked = self._walked[begin : stop + 2] - self._walked[begin]
        w = walked / max(float(walked[-1]), 1e-300)
        along = np.diff(self.track.points(np.full(len(w), i), w), axis=0)
        made = self.path.end[begin : stop + 1] - self.path.start[begin : stop + 1]
        return float(sizes(made - along).sum())
