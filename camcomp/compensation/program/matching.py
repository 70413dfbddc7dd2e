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

    def match(self, *, foreign: bool) -> tuple[Ints, Ints, int]:
        """Moves [first, last) that belong to every piece (p,), and the number of joining lines.

        foreign: another model put them there. Raises CheckFailed CC604 when the path is not one of these pieces.
        """
        if not foreign:
            try:
                first, last, joins, off = self._as_expected()
            except CheckFailed:
                if not self.stamped:
                    raise
            else:
                if off <= SURE_MM or not self.stamped:
                    return first, last, joins
        return self._by_course() or self._as_expected()[:3]

    def limit(self, piece: int) -> float:
        """Length, mm, that the moves of a piece may have together."""
        return float(1.3 * max(self.track.length[piece], self.reach[piece]) + NEAR_MM)

    def _as_expected(self) -> tuple[Ints, Ints, int, float]:
        """The match if joining lines are where the model has them, and how far off the worst end is, mm."""
        track, expected, layout, end = self.track, self.expected, self.layout, self.path.end
        n, moves = len(track.motion), len(end)
        first, last = np.zeros(n, np.int64), np.zeros(n, np.int64)
        at = joins = 0
        worst = 0.0
        for i in range(n):
            if self.stamped and layout.leading[i]:
                at, joins = at + 1, joins + 1
            left = n - i - 1
            stop, walked = at, 0.0
            best, found = np.inf, -1
            limit = self.limit(i)
            while stop < moves - left:
                walked += self.step[stop]
                if walked > limit and stop > at:
                    break
                off = float(np.linalg.norm(end[stop] - expected[i]))
                score = off + 0.1 * min(abs(walked - track.length[i]), abs(walked - self.reach[i]))
                if score < best - 1e-9:
                    best, found = score, stop
                stop += 1
            if found < 0 or best > NEAR_MM + 0.1 * limit:
                line = int(track.path.line[track.motion[i]])
                raise CheckFailed("CC604", f"no moves that cut line {line} of the original are found")
            first[i], last[i] = at, found + 1
            worst = max(worst, float(np.linalg.norm(end[found] - expected[i])))
            at = found + 1
            if self.stamped and layout.trailing[i]:
                at, joins = at + 1, joins + 1
        if at != moves:
            raise CheckFailed("CC604", f"{moves - at} moves at the end have no counterpart in the original")
        return first, last, joins, worst

    def _by_course(self) -> tuple[Ints, Ints, int] | None:
        """The match whose moves go best along their pieces, with joining lines wherever feed lines can join; None: there is none."""
        n, moves, step = len(self.track.motion), len(self.path), self.step
        feeding = self.layout.corrected & (self.track.path.kind[self.track.motion] != RAPID)
        joins = (self.path.kind != RAPID) & (step < NEAR_MM)
        ways = [_Way(0.0, 0.0, 0, 0, None)]
        for i in range(n):
            grown: dict[int, _Way] = {}
            room = moves - (n - i - 1)
            for way in ways:
                for lead in (0, 1) if feeding[i] else (0,):
                    begin = way.at + lead
                    if begin >= room or (lead and not joins[way.at]):
                        continue
                    cost = way.cost + lead * JOINING * step[way.at]
                    for stop, more, longer in self._ends(i, begin, room):
                        for trail in (0, 1) if feeding[i] and stop + 1 < room else (0,):
                            if trail and not joins[stop + 1]:
                                continue
                            total = cost + more + (JOINING * step[stop + 1] if trail else 0.0)
                            behind = stop + 1 + trail
                            if behind not in grown or total < grown[behind].cost:
                                count, stretch = way.joins + lead + trail, way.stretch + longer
                                grown[behind] = _Way(total, stretch, behind, count, (way.bounds, begin, stop + 1))
            ways = sorted(grown.values(), key=lambda each: each.cost + each.stretch)[:WAYS]
        whole = [way for way in ways if way.at == moves]
        if not whole:
            return None
        first, last = np.zeros(n, np.int64), np.zeros(n, np.int64)
        best = min(whole, key=lambda each: each.cost)
        bounds = best.bounds
        for i in range(n - 1, -1, -1):
            assert bounds is not None
            bounds, first[i], last[i] = bounds
        return first, last, best.joins

    def _ends(self, i: int, begin: int, room: int) -> list[tuple[int, float, float]]:
        """Last moves that piece i may have if it begins with move `begin`, what each of them costs, and the stretch, mm."""
        path, track, limit = self.path, self.track, self.limit(i)
        run = np.cumsum(self.step[begin:room])
        run = run[: max(int(np.searchsorted(run, limit, side="right")), 1)]
        off = sizes(path.end[begin : begin + len(run)] - self.expected[i])
        longer = np.minimum(np.abs(run - track.length[i]), np.abs(run - self.reach[i]))
        off += 0.1 * longer
        near = [int(k) for k in np.argsort(off, kind="stable")[:ENDS] if off[k] <= NEAR_MM + 0.1 * limit]
        out = []
        for k in near:
            w = np.concatenate(([0.0], run[: k + 1] / max(float(run[k]), 1e-300)))
            along = np.diff(track.points(np.full(len(w), i), w), axis=0)
            made = path.end[begin : begin + k + 1] - path.start[begin : begin + k + 1]
            out.append((begin + k, float(sizes(made - along).sum()), float(longer[k])))
        return out
