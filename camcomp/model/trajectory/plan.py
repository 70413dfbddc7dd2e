"""Planned trajectory of a controller: path with blended corners, and time.

Model of a planner with limited look-ahead and limited acceleration of every axis: it merges lines (merging.py), blends
corners (corners.py) and sets the speed along them (speeds.py).
"""

from __future__ import annotations

import numpy as np

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, RAPID, Bools, Floats, Ints
from camcomp.ground.records import dataclass
from camcomp.ground.vectors import sizes
from camcomp.model.trajectory.corners import CYCLES, corners, nearest
from camcomp.model.trajectory.merging import straight
from camcomp.model.trajectory.moves import ControlLimits, ToolMoves
from camcomp.model.trajectory.rounding import NORMAL
from camcomp.model.trajectory.segments import read_only, segments
from camcomp.model.trajectory.speeds import durations, pieces

RAPID_MM_PER_S = 10_000.0 / 60.0  # default without a stated velocity


@dataclass(frozen=True, eq=False, kw_only=True)
class ControlPlan:
    """Trajectory and time of moves (n,) as m segments; every corner is the one after its segment."""

    moves: ToolMoves
    group: Ints  # (n,) segment of every move
    start: Floats  # (m, 3) mm
    end: Floats  # (m, 3) mm
    arc: Bools  # (m,)
    way: Ints  # (m,) of the corner: REST, ON, ROUND, OVERLAP, WAIT
    reach: Floats  # (m,) mm of either segment that the corner takes
    bend: Floats  # (m,) mm, radius of its arc
    centre: Floats  # (m, 3) mm
    time: Floats  # (m,) s
    passes: Floats  # (m,) mm/s at the start of the straight part of a segment

    @property
    def duration_s(self) -> float:
        """Duration of all moves, s."""
        return float(self.time.sum())

    def leaves_by(self, move: Ints, points: Floats) -> Floats:
        """Vectors (k, 3) mm from points (k, 3) mm on moves (k,) to the nearest points of the trajectory."""
        out = np.zeros((len(move), 3))
        if len(self.time):
            nearest(np.ascontiguousarray(points), self.group[move], self.start, self.end, self.arc, self.way, self.reach,
                    self.bend, self.centre, out)  # fmt: skip
        return out


def plan_of(moves: ToolMoves, limits: ControlLimits, arrives: float = 0.0) -> ControlPlan:
    """Plan of the controller for moves (n,) that end at standstill. arrives: mm/s at the start of the first one."""
    found = segments(moves)
    first, last = found.first, found.last
    m = len(first)
    start, end = moves.start.take(first, axis=0), moves.end.take(last, axis=0)
    kind, feed = moves.kind[last], moves.feed[last]
    nominal, leave, most = np.empty(m), np.empty((m, 3)), np.empty(m)
    straight(*read_only(start, end), nominal, leave, most)
    arrive, axis, middle, radius, angle = leave, leave, end, np.zeros(m), np.zeros(m)
    arc = kind == ARC
    if arc.any():
        at = np.flatnonzero(arc)
        path = moves.take(last[at])
        every, zeros = np.arange(len(at)), np.zeros(len(at))
        arrive, axis, middle = leave.copy(), np.zeros((m, 3)), np.zeros((m, 3))
        leave[at], arrive[at] = (path_geometry.tangents(path, every, zeros + u) for u in (0.0, 1.0))
        nominal[at], most[at], axis[at], angle[at] = path_geometry.lengths(path), 1.0, path.axis, np.abs(path.angle)
        middle[at] = path.centre
        radius[at] = sizes(path.start - path.centre)
    acceleration = limits.acceleration * most
    fast, reachable = _speeds(kind=kind, feed=feed, nominal=nominal, radius=radius, most=most, limits=limits)
    way, centre = np.zeros(m, np.int64), np.zeros((m, 3))
    speed, reach, bend, around, time = np.zeros((5, m))
    length, slope, fastest, passes = np.empty((4, 2 * m))
    if m:
        corners(leave, arrive, axis, middle, radius, angle, nominal, fast, reachable, acceleration, kind == RAPID, moves.per_turn[last], moves.exact[last], moves.stop[last], found.waits,
                moves.tolerance[last],
                limits.acceleration, limits.velocity, limits.cycle_s, way, speed, reach, bend, around, centre, end)  # fmt: skip
        pieces(nominal, fast, reachable, acceleration, radius, way, speed, reach, bend, around, length, slope, fastest)
        durations(length, slope, fastest, way, speed, limits.cycle_s, limits.look_ahead, arrives, passes, time)
    return ControlPlan(
        moves=moves,
        group=found.group,
        start=start,
        end=end,
        arc=arc,
        way=way,
        reach=reach,
        bend=bend,
        centre=centre,
        time=time,
        passes=passes[::2],
    )


def _speeds(
    kind: np.ndarray, feed: Floats, nominal: Floats, radius: Floats, most: Floats, limits: ControlLimits
) -> tuple[Floats, Floats]:
    """Largest speeds (m,) mm/s along segments within the limits of every axis: at the feed, and at any feed."""
    velocity = limits.velocity * most
    shortest = nominal / (CYCLES * limits.cycle_s)
    turning = np.sqrt(NORMAL * limits.acceleration * np.where(radius > 0.0, radius, np.inf))
    asked = np.where(kind == RAPID, RAPID_MM_PER_S, feed / 60.0)
    any_feed = np.where(np.isinf(velocity), np.fmax(asked, RAPID_MM_PER_S), velocity)
    reachable = np.minimum(np.minimum(any_feed, shortest), turning)
    fast = np.where((kind == RAPID) | ~(asked > 0.0), reachable, np.minimum(asked, reachable))
    return fast, reachable
