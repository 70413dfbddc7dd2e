"""Engagement of the tool along a path with a known stock: arcs of its turn at places of every motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Self

import numpy as np

from camcomp.ground.datatypes import Bools, Floats, Ints, Path
from camcomp.ground.records import Rows, dataclass, replace


@dataclass(frozen=True, eq=False, kw_only=True)
class EngagementArcs(Rows):
    """Engagement arcs (b,) of a tool's turn, several per place if the material has several heights.

    Angles count as in engagement.py for a clockwise spindle. rise, run: of the tool's surface per length of its edge;
    (1, 0) at the side of a cylinder.
    """

    place: Ints  # (b,) in order
    start: Floats  # (b,) rad
    stop: Floats  # (b,) rad
    height: Floats  # (b,) mm of tool that cuts
    rise: Floats
    run: Floats

    def take(self, rows: Ints) -> Self:
        """The arcs of some places (r,), renumbered from 0."""
        if len(rows) and rows[-1] - rows[0] + 1 == len(rows) and bool((np.diff(rows) == 1).all()):
            a, b = np.searchsorted(self.place, (rows[0], rows[-1] + 1)).tolist()
            return replace(super().take(slice(a, b)), place=self.place[a:b] - rows[0])
        first = np.searchsorted(self.place, rows, "left")
        count = np.searchsorted(self.place, rows, "right") - first
        at = np.repeat(first - np.concatenate(([0], np.cumsum(count)[:-1])), count) + np.arange(count.sum())
        fresh = np.repeat(np.arange(len(rows)), count)
        return replace(super().take(at), place=fresh)

    def reach(self, places: int) -> Floats:
        """Extent (places,) of the arcs of every place across the feed, in radii of the tool."""
        left, right = np.full(places, -1.0), np.full(places, 1.0)
        np.maximum.at(left, self.place, np.cos(self.start))
        np.minimum.at(right, self.place, np.cos(self.stop))
        return np.where(np.bincount(self.place, minlength=places) > 0, left - right, 0.0)

    def turned(self, clockwise: Bools) -> tuple[Floats, Floats]:
        """Entry and exit (b,) rad for spindles (places,) that turn clockwise or not."""
        same = clockwise[self.place]
        return np.where(same, self.start, np.pi - self.stop), np.where(same, self.stop, np.pi - self.start)


@dataclass(frozen=True, eq=False, kw_only=True)
class Engaged(Rows):
    """Places (k,) along the motions of a path, in order, with the engagement arcs; between them the engagement is linear.

    Two places at one fraction of a motion are a jump. Motions without places do not cut.
    """

    motion: Ints  # (k,)
    u: Floats  # (k,) fraction of the motion
    depth: Floats  # (k,) mm, the highest material over the tip
    turn: Floats  # (k,) rad, sum of the engaged arcs
    bends: Bools  # (k,) the place determines the force; others only depth and sum of the arcs
    arcs: EngagementArcs

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Concatenation of consecutive parts."""
        before = np.cumsum([0] + [len(each.u) for each in parts[:-1]])
        places = [each.arcs.place + n for each, n in zip(parts, before, strict=True)]
        return super().joined(
            [replace(each, arcs=replace(each.arcs, place=at)) for each, at in zip(parts, places, strict=True)]
        )

    def of_motions(self, first: int, last: int, number: int = 0) -> Engaged:
        """The places of motions first to last (excluded), renumbered from `number`."""
        out = self.take(np.arange(np.searchsorted(self.motion, first), np.searchsorted(self.motion, last)))
        return replace(out, motion=out.motion - first + number)

    def around(self, motion: Ints, u: Floats) -> tuple[Ints, Ints, Bools]:
        """Rows of the places before and after points (n,) of motions, and mask (n,) of points that have both."""
        n = len(self.u)
        right = np.clip(np.searchsorted(self.motion + 0.5 * self.u, motion + 0.5 * u), min(1, n), max(n - 1, 0))
        left = np.maximum(right - 1, 0)
        known = (self.motion[left] == motion) & (self.motion[right] == motion) & (left < right) if n else right < left
        return left, right, known

    def between(self, motion: Ints, u: Floats, behind: Bools) -> tuple[Ints, Ints, Floats]:
        """Rows of the places on both sides of points (n,) of motions with places, and the share of the second one.

        behind (n,): after a jump at the point, otherwise before it.
        """
        hair = np.where(behind, 1e-9, -1e-9)
        left, right, known = self.around(motion, np.clip(u + hair, 1e-12, 1.0 - 1e-12))
        span = np.where(known, self.u[right] - self.u[left], 0.0)
        share = np.clip(np.divide(u - self.u[left], span, out=np.zeros(len(u)), where=span > 0.0), 0.0, 1.0)
        return left, right, share

    def sizes(self, motion: Ints, u: Floats, behind: Bools) -> tuple[Floats, Floats]:
        """Depth (n,) mm and sum of the arcs (n,) rad at points (n,) of motions; zero on motions without places."""
        depth, turn = np.zeros(len(u)), np.zeros(len(u))
        on = np.flatnonzero(np.isin(motion, self.motion))
        left, right, share = self.between(motion[on], u[on], behind[on])
        depth[on] = (1.0 - share) * self.depth[left] + share * self.depth[right]
        turn[on] = (1.0 - share) * self.turn[left] + share * self.turn[right]
        return depth, turn


Engage = Callable[[Path], Engaged]
