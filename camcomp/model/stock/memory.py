"""Stock during a program: engagement of every motion, and removal of its material in order."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from camcomp.ground.datatypes import Floats, Ints, Path
from camcomp.ground.records import dataclass, replace
from camcomp.model.cutting.engaged import Engaged, EngagementArcs
from camcomp.model.stock.along_legs import ROOM_FOR_ARCS, ROOM_FOR_PLACES, cut_legs, peek, settle
from camcomp.model.stock.at_tip import meet, take_way
from camcomp.model.stock.facets import facets_on
from camcomp.model.stock.field import SPAN, TOUCHED, USED, XMAX, XMIN, ZMAX, ZMIN, room_for
from camcomp.model.stock.front import ARC_COLUMNS, DEPTH, EDGE, ENGAGED, WHAT, Place
from camcomp.model.stock.legs import LegBefore, Legs, legs_of
from camcomp.model.stock.places import CHAIN_DEEP, CUT_LEG, DEEP, MOST_CHAIN, MOST_RECENT, PLACES, ROWS, Found
from camcomp.model.stock.shapes import StockShape, ToolShape
from camcomp.model.stock.thinning import thin

COARSEST_MM, FINEST_MM = 0.25, 0.05
MOST_NODES = 1 << 25  # of 16 bytes; only nodes that a tool touches take memory
MARGIN = 5  # nodes around the stock
ARCS = 256  # of one place
NO_TOOL = -1


def cell_for(stock: StockShape, tools: Mapping[int, ToolShape]) -> float:
    """Distance of the nodes (mm) at which a wall bulges by less than EDGE between them."""
    radius = min((0.5 * each.diameter_mm for each in tools.values()), default=1.0)
    fine = float(np.clip(0.9 * np.sqrt(8.0 * radius * EDGE), FINEST_MM, COARSEST_MM))
    area = float(np.prod(np.maximum(stock.high[:2] - stock.low[:2], fine)))
    return max(fine, float(np.sqrt(area / MOST_NODES)))


class StockMemory:
    """A stock from which motions remove material in the order of the calls."""

    def __init__(self, stock: StockShape, tools: Mapping[int, ToolShape], cell_mm: float | None = None) -> None:
        """tools: by T number; NO_TOOL: all numbers without an entry. cell_mm: distance of the nodes, None: cell_for."""
        self.cell = cell_for(stock, tools) if cell_mm is None else cell_mm
        self._number = {number: k for k, number in enumerate(tools)}
        rows = np.array([row for each in tools.values() for row in each.rows()])
        rise = max(each.rise(SPAN * self.cell) for each in tools.values())
        size = np.ceil((stock.high - stock.low)[:2] / self.cell).astype(int) + 2 * MARGIN
        place = np.concatenate(
            (stock.low[:2] - (MARGIN - 0.5) * self.cell, [self.cell, stock.form], stock.low, stock.high, [rise])
        )
        facet, mesh = facets_on(stock, place, size)
        self.nodes = room_for(
            place=place, rows=int(size[1]), columns=int(size[0]), tools=rows, sweeps=1 << 12, facet=facet, mesh=mesh
        )
        self._place = Place(
            at=np.zeros(8),
            row=np.zeros(1, np.int64),
            recent=np.zeros(MOST_RECENT, np.int64),
            many=np.zeros(1, np.int64),
            told=np.zeros(WHAT),
            arcs=np.zeros((ARCS, 2)),
        )
        n, r, deep = 4 * ROOM_FOR_PLACES, 2 * ROOM_FOR_ARCS, DEEP + CHAIN_DEEP
        self._found = Found(
            leg=np.zeros(n, np.int64),
            u=np.zeros(n),
            first=np.zeros(n, np.int64),
            many=np.zeros(n, np.int64),
            told=np.zeros((n, WHAT)),
            arc_rows=np.zeros((r, ARC_COLUMNS)),
            crash=np.zeros(0, np.bool_),
            recent_end=np.zeros(MOST_RECENT),
            way=np.zeros(2),
            told_of=np.zeros(3, np.int64),
            stack_u=np.zeros(deep),
            stack=np.zeros((deep, WHAT)),
            stack_rows=np.zeros((deep, 2), np.int64),
            chain_way=np.zeros(MOST_CHAIN + 1),
            chain_number=np.zeros(CHAIN_DEEP, np.int64),
        )
        self._before = LegBefore()
        self._kept = self._kept_rows = 0  # places and arcs kept from the call before

    @property
    def touched(self) -> bool:
        """Whether a motion has removed material yet."""
        return bool(self.nodes.counts[TOUCHED])

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Corners (3,) mm of the uncut stock."""
        return self.nodes.place[XMIN : ZMIN + 1].copy(), self.nodes.place[XMAX : ZMAX + 1].copy()

    def settle(self) -> None:
        """Remove the recent sweeps from the field."""
        settle(self.nodes, self._place, self._found)

    def follow(self, path: Path, *, ahead: int = 0) -> tuple[Engaged, Ints]:
        """Engagement of the motions of a path, and numbers of the rapids that move through material.

        ahead: number of motions at the end that are not cut; they only determine how the motion before them ends.
        """
        legs = legs_of(path, self._before)
        tool = np.array([self._tool(int(t)) for t in np.unique(path.tool)])
        tool = tool[np.searchsorted(np.unique(path.tool), path.tool[legs.motion])] if len(legs.motion) else legs.motion
        own = int(np.searchsorted(legs.motion, len(path) - ahead))
        crash = np.zeros(max(own, 1), np.bool_)
        found = self._found._replace(crash=crash)
        joined = np.append(legs.joined[:own], legs.joined[own : own + 1]) if own else np.zeros(1, np.bool_)
        parts: list[_Places] = []
        leg = 0
        self._carry_over()
        while leg < own:
            at = cut_legs(self.nodes, self._place, found, legs.kind[:own], legs.table[:own], tool[:own], joined, leg)
            parts.append(self._taken())
            self._make_room()
            leg = at
        if ahead and own < len(legs.motion):
            peek(self.nodes, self._place, found, legs.table, tool, own)
            parts.append(self._taken(keep=False))
        if len(path) > ahead:
            self._before = self._behind(path, legs, own, len(path) - ahead - 1)
        return _engaged(parts, legs), np.unique(legs.motion[:own][crash[:own]])

    def meet(self, tip: Floats, direction: Floats, tool: int) -> tuple[float, EngagementArcs]:
        """Depth (mm) and engagement arcs of a tool (T number) at a tip (3,) mm that moves along a unit direction (3,).

        Not to be mixed with `follow`.
        """
        n = meet(self.nodes, self._place, self._found, tip, direction, self._tool(tool))
        start, stop, height, rise, run, _ = self._found.arc_rows[:n].T.copy()
        return float(self._place.told[DEPTH]), EngagementArcs(
            place=np.zeros(n, np.int64), start=start, stop=stop, height=height, rise=rise, run=run
        )

    def take(self, start: Floats, end: Floats, tool: int, lag_mm: float) -> None:
        """Remove the straight sweep of a tool between two tip positions (3,) mm once the tip is lag_mm farther."""
        self._make_room()
        take_way(self.nodes, self._place, self._found, start, end, self._tool(tool), lag_mm)

    def _tool(self, number: int) -> int:
        return self._number.get(number, self._number.get(NO_TOOL, 0))

    def _behind(self, path: Path, legs: Legs, own: int, motion: int) -> LegBefore:
        """The last leg of this path for the next one; motions without length only change the position."""
        known = bool(path.known[motion] & ~path.machine[motion])
        if own == 0:
            return replace(self._before, known=known)
        if legs.kind[own - 1] != CUT_LEG:
            return LegBefore(known)
        return LegBefore(known, legs.ends[own - 1], int(path.tool[legs.motion[own - 1]]))

    def _carry_over(self) -> None:
        """Assign the last place of the call before to the leg before the next ones (number -1)."""
        if self._found.told_of[PLACES]:
            self._found.leg[0] = -1

    def _taken(self, *, keep: bool = True) -> _Places:
        """Places found since the last call; the last of them is kept, because the next leg may start there."""
        found = self._found
        n, r = int(found.told_of[PLACES]), int(found.told_of[ROWS])
        first = self._kept
        out = _Places(
            leg=found.leg[first:n].copy(),
            u=found.u[first:n].copy(),
            first=found.first[first:n].copy(),
            many=found.many[first:n].copy(),
            told=found.told[first:n].copy(),
            arc_rows=found.arc_rows[:r].copy(),
        )
        if not keep:
            found.told_of[PLACES] = self._kept
            found.told_of[ROWS] = self._kept_rows
            return out
        if n:
            a, many = int(found.first[n - 1]), int(found.many[n - 1])
            found.arc_rows[:many] = found.arc_rows[a : a + many].copy()
            for each in (found.leg, found.u, found.told):
                each[0] = each[n - 1]
            found.first[0], found.many[0] = 0, many
            self._kept, self._kept_rows = 1, many
            found.told_of[PLACES], found.told_of[ROWS] = 1, many
        return out

    def _make_room(self) -> None:
        """Double the room for sweeps before it is used up."""
        nodes = self.nodes
        if nodes.counts[USED] + 1024 < len(nodes.sweeps):
            return
        more = len(nodes.sweeps)
        self.nodes = nodes._replace(
            sweeps=np.concatenate((nodes.sweeps, np.empty((more, nodes.sweeps.shape[1])))),
            kept=np.concatenate((nodes.kept, np.zeros(more, np.int32))),
            free=np.concatenate((nodes.free, np.zeros(more, np.int32))),
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class _Places:
    """Places of consecutive legs before thinning; columns as in places.Found."""

    leg: Ints
    u: Floats
    first: Ints
    many: Ints
    told: Floats
    arc_rows: Floats


def _engaged(parts: list[_Places], legs: Legs) -> Engaged:
    """The places that linear interpolation needs, in order."""
    rows = np.cumsum([0] + [len(each.arc_rows) for each in parts])
    leg, u, told = (
        np.concatenate([getattr(each, name) for each in parts] or [empty])
        for name, empty in (("leg", np.zeros(0, np.int64)), ("u", np.zeros(0)), ("told", np.zeros((0, WHAT))))
    )
    first = np.concatenate([each.first + n for each, n in zip(parts, rows, strict=False)] or [np.zeros(0, np.int64)])
    many = np.concatenate([each.many for each in parts] or [np.zeros(0, np.int64)])
    arc_rows = np.concatenate([each.arc_rows for each in parts] or [np.zeros((0, ARC_COLUMNS))])
    motion = legs.motion[leg]
    at = np.where(u == 1.0, legs.u1[leg], legs.u0[leg] + u * (legs.u1[leg] - legs.u0[leg]))
    # Two legs of an arc share the place between them.
    twice = np.flatnonzero((motion[1:] == motion[:-1]) & (at[1:] == at[:-1])) + 1
    twice = twice[(told[twice, :DEPTH] == told[twice - 1, :DEPTH]).all(axis=1)]
    if len(twice):
        motion, at, told, first, many = (np.delete(each, twice, axis=0) for each in (motion, at, told, first, many))
    keep = np.zeros(len(motion), np.bool_)
    stack = np.zeros((2 * len(motion) + 2, 2), np.int64)
    thin(motion, at, told, DEPTH, keep, stack)
    bends = keep.copy()
    thin(motion, at, told, DEPTH + 2, keep, stack)
    if not keep.all():
        motion, at, told, first, many, bends = (each[keep] for each in (motion, at, told, first, many, bends))
    place = np.repeat(np.arange(len(many)), many)
    row = np.repeat(first - (np.cumsum(many) - many), many) + np.arange(int(many.sum()))
    start, stop, height, rise, run, _ = arc_rows[row].T
    engaged_here = EngagementArcs(place=place, start=start, stop=stop, height=height, rise=rise, run=run)
    return Engaged(motion=motion, u=at, depth=told[:, DEPTH], turn=told[:, ENGAGED], bends=bends, arcs=engaged_here)
