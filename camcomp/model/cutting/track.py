"""The path cut into pieces of one kind of load, and the cutting force at any point of a piece.

A piece is a motion, or the part of a motion on one side of the stock's top, or of the point where an arc passes the
vertical and the direction across the tool turns over, or, where the stock is known, between two places of its engagement. Rapids and air moves carry no force, and
plunges none unless the force model says otherwise. Where two cutting pieces meet at less than JOIN_ANGLE the corner
takes the force of the bisecting direction and the difference fades linearly along the pieces; where they meet at more,
where a cut starts or ends, and where the model gives both sides different forces in one direction (another feed, speed
or sense of the spindle, another tool, a step of a table) the force jumps.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, RAPID, Bools, Floats, Ints, Path
from camcomp.ground.records import dataclass, field, replace
from camcomp.ground.vectors import sizes
from camcomp.model.cutting.corners import find_corners, share_loads
from camcomp.model.cutting.cut import Cut
from camcomp.model.cutting.engaged import Engage, Engaged, EngagementArcs
from camcomp.model.cutting.frame import lateral, to_vector
from camcomp.model.cutting.path_pieces import divide_motions, whole_motions
from camcomp.model.cutting.piece_load import PieceLoad, needed
from camcomp.model.cutting.upright import Verticals

JOIN_ANGLE = np.radians(5.0)
PLUNGE_SINE = (
    5e-3  # of the angle between feed and tool axis: corrected plunges slant by some 1e-4, rounded short ones too
)


class Edges(NamedTuple):
    """Diameter and number of teeth of a tool, for force models."""

    diameter_mm: float | None
    teeth: int | None


@dataclass(frozen=True, eq=False, kw_only=True)
class Conditions:
    """Cutting conditions from the machine file. model: Cut -> (Fr, Ft, Fz) (k, 3) N, None = no force.

    engage: engagement of a path with the uncut stock, None: the stock is unknown.
    """

    model: Callable[[Cut], Floats] | None
    plunges: bool = False
    steady: bool = False  # the force depends on the cut alone, not on how far along the path it is
    tool_axis: Floats = (0.0, 0.0, 1.0)  # type: ignore[assignment]  # program frame, away from the workpiece
    stock_top_mm: float | None = None
    depth_mm: float | None = None
    width_mm: float | None = None
    spindle_rpm: float | None = None
    feed_mm_per_min: float | None = None
    diameter_mm: float | None = None
    teeth: int | None = None
    to_machine: Floats | None = None
    tools: Mapping[int, Edges] = field(default_factory=dict)  # by T number; other tools: diameter_mm and teeth above
    engage: Engage | None = None

    def edges(self, tool: int) -> Edges:
        """The tool of a T number."""
        return self.tools.get(tool, Edges(self.diameter_mm, self.teeth))

    def feeds(self, feed: Floats) -> Floats:
        """Feeds (n,) mm/min of a program, that of the machine file where none is in force."""
        return np.where(np.isnan(feed), self.feed_mm_per_min or np.nan, feed)


@dataclass(frozen=True, eq=False, kw_only=True)
class Track:
    """Pieces (p,) of a path, in order. motion: index into the path; u0, u1: part of the motion."""

    path: Path
    conditions: Conditions
    motion: Ints
    u0: Floats
    u1: Floats
    cutting: Bools  # the cutting force model applies
    length: Floats  # mm
    s0: Floats  # mm path length at the start of the piece
    fade0: Floats  # (p, 3) N, what the corner's force adds at the start of the piece, program frame
    fade1: Floats  # (p, 3) N, at its end
    jump: Bools  # the force jumps at the start of the piece
    corner: Bools  # the tip cannot pass the start of the piece without a stop
    beside0: Floats  # fraction of the motion after the start of the piece at which its direction is taken
    beside1: Floats  # fraction of the motion before its end at which its direction is taken
    own0: Floats  # (p, 3) N, the model's force at the start of the piece, program frame
    own1: Floats  # (p, 3) N, at its end
    even: Bools  # (p,) between its ends the model's force is linear
    load: PieceLoad | None = None  # if the stock is known
    engaged: Engaged | None = None  # if the stock is known
    began_min: float = 0.0  # minutes that the program takes before this path, when it is a part of one

    @property
    def angle(self) -> Floats:
        """(p,) rad, part of the arc; 0 for lines."""
        angle = self.path.angle[self.motion]
        return np.where(np.isnan(angle), 0.0, angle) * (self.u1 - self.u0)

    def u(self, piece: Ints, w: Floats) -> Floats:
        """Fraction of the motion at fraction w of the piece."""
        if self._whole:
            return w
        begin, end = self.u0[piece], self.u1[piece]
        return np.where(w == 1.0, end, begin + w * (end - begin))

    @cached_property
    def _whole(self) -> bool:
        """Whether every piece is a whole motion."""
        return bool((self.u0 == 0.0).all() and (self.u1 == 1.0).all())

    def points(self, piece: Ints, w: Floats) -> Floats:
        """Programmed tip (k, 3) mm at fraction w (k,) of piece (k,)."""
        return path_geometry.points(self.path, self.motion[piece], self.u(piece, w))

    def minutes_cut(self, motion: int, share: float) -> float:
        """Minutes of cutting as programmed, without acceleration, from the start of the path to a share (0 to 1) of a motion."""
        within = np.clip((share - self.u0) / np.maximum(self.u1 - self.u0, 1e-12), 0.0, 1.0)
        done = np.where(self.motion < motion, 1.0, np.where(self.motion == motion, within, 0.0))
        feed = self.path.feed[self.motion[self.cutting]]
        return float(np.sum((done * self.length)[self.cutting] / feed))

    def cut(self, piece: Ints, w: Floats) -> Track:
        """Track with pieces divided at fractions w (k,), inside, of pieces (k,); loads are interpolated linearly."""
        n = len(self.motion)
        of = np.concatenate((np.arange(n), piece))
        begin = np.concatenate((np.zeros(n), w))
        order = np.lexsort((begin, of))
        of, begin = of[order], begin[order]
        end = np.where(np.append(of[1:] == of[:-1], False), np.append(begin[1:], 1.0), 1.0)
        inner = begin > 0.0
        a, b, c, d = self.fade0[of], self.fade1[of], self.own0[of], self.own1[of]
        return replace(
            self, motion=self.motion[of], u0=self.u(of, begin), u1=self.u(of, end), cutting=self.cutting[of],
            length=(end - begin) * self.length[of], s0=self.s0[of] + begin * self.length[of],
            fade0=a + begin[:, None] * (b - a), fade1=a + end[:, None] * (b - a), jump=self.jump[of] & ~inner,
            corner=self.corner[of] & ~inner, beside0=np.where(inner, 0.0, self.beside0[of]),
            beside1=np.where(end < 1.0, 0.0, self.beside1[of]), own0=c + begin[:, None] * (d - c),
            own1=c + end[:, None] * (d - c), even=self.even[of],
            load=None if self.load is None else self.load.cut(of, begin, end),
        )  # fmt: skip

    def force(self, piece: Ints, w: Floats, feed: Floats | None = None) -> Floats:
        """Cutting force on the tool (k, 3) N, program frame; feed (k,) mm/min as driven, else the program's."""
        if feed is None and self.even[piece].all():
            out = np.empty((len(piece), 3))
            path_geometry.between_ends(*self._ends, piece, w, out)
            return out
        tangent = path_geometry.tangents(self.path, self.motion[piece], _beside(self, piece, w))
        out = self.force_along(piece, w, tangent, feed)
        return out + (1.0 - w)[:, None] * self.fade0[piece] + w[:, None] * self.fade1[piece]

    @cached_property
    def _ends(self) -> tuple[Floats, Floats]:
        """Force (p, 3) N at the start and at the end of every piece."""
        return self.own0 + self.fade0, self.own1 + self.fade1

    def sizes(self, piece: Ints, w: Floats) -> tuple[Floats, Floats]:
        """Depth of the cut (k,) mm and sum of the engagement arcs (k,) rad, NaN if the stock is unknown."""
        if self.engaged is None:
            return np.full(len(piece), np.nan), np.full(len(piece), np.nan)
        return self.engaged.sizes(self.motion[piece], self.u(piece, w), w == 0.0)

    def force_along(self, piece: Ints, w: Floats, direction: Floats, feed: Floats | None = None) -> Floats:
        """Cutting force on the tool (k, 3) N, program frame, for a tip driven along unit vectors direction (k, 3)."""
        if self.load is not None and feed is not None and not self.conditions.plunges:
            return self._driven(piece, w, direction, feed)
        c, turn, out = self.conditions, self.path.orientation, np.zeros((len(piece), 3))
        cuts = self.cutting[piece] & (sizes(direction) > 0.0)
        if c.model is None or not cuts.any():
            return out
        on = slice(None) if cuts.all() else np.flatnonzero(cuts)
        turned = None if turn is None else turn.rotations(self.motion[piece], self.u(piece, w))
        seen = direction if turned is None else np.einsum("kji,kj->ki", turned, direction)  # in the frame of the tool
        at, share = piece[on], w[on]
        if self.load is not None and not c.plunges:
            found = self.load.base(at, share)
        else:
            depth, width = (np.full(len(at), np.nan if each is None else each) for each in (c.depth_mm, c.width_mm))
            if c.depth_mm is None and c.stock_top_mm is not None:
                depth = c.stock_top_mm - self.points(at, share)[:, 2]
            found = _components(
                path=self.path, c=c, motion=self.motion[at], direction=seen[on], depth=depth, width=width,
                s=self.s0[at] + share * self.length[at], ends=share == 1.0, driven=None if feed is None else feed[on],
            )  # fmt: skip
        out[on] = to_vector(found, seen[on], c.tool_axis)
        return out if turned is None else np.einsum("kij,kj->ki", turned, out)

    def force_meeting(self, piece: Ints, w: Floats, direction: Floats, depth: Floats, arcs: EngagementArcs) -> Floats:
        """Cutting force (k, 3) N, program frame, of a tool with these engagement arcs (k places) that moves along `direction`."""
        c, rows = self.conditions, self.motion[piece]
        s = self.s0[piece] + w * self.length[piece]
        found = _components(
            path=self.path,
            c=c,
            motion=rows,
            direction=direction,
            depth=depth,
            width=arcs.reach(len(rows)),
            s=s,
            ends=w == 1.0,
            arcs=arcs,
        )
        return to_vector(found, direction, c.tool_axis)

    def _driven(self, piece: Ints, w: Floats, direction: Floats, feed: Floats) -> Floats:
        """Cutting force (k, 3) N at driven feeds (k,): linear between the model's forces at the places on both sides."""
        assert self.engaged is not None
        out = np.zeros((len(piece), 3))
        on = np.flatnonzero(self.cutting[piece] & (sizes(direction) > 0.0))
        motion, u = self.motion[piece[on]], self.u(piece[on], w[on])
        left, right, share = self.engaged.between(motion, u, w[on] == 0.0)
        seen = _in_tool_frame(self.path, motion, u, direction[on])
        s = self.s0[piece[on]] + w[on] * self.length[piece[on]]
        for rows, part in ((left, 1.0 - share), (right, share)):
            arcs = self.engaged.arcs.take(rows)
            reach, depth = arcs.reach(len(rows)), self.engaged.depth[rows]
            found = _components(
                path=self.path,
                c=self.conditions,
                motion=motion,
                direction=seen,
                depth=depth,
                width=reach,
                s=s,
                ends=w[on] == 1.0,
                arcs=arcs,
                driven=feed[on],
            )
            out[on] += part[:, None] * to_vector(found, seen, self.conditions.tool_axis)
        if self.path.orientation is not None:
            out[on] = np.einsum("kij,kj->ki", self.path.orientation.rotations(motion, u), out[on])
        return out


def _components(
    path: Path, c: Conditions, motion: Ints, direction: Floats, depth: Floats, *, width: Floats, s: Floats, ends: Bools,
    arcs: EngagementArcs | None = None, driven: Floats | None = None,
) -> Floats:  # fmt: skip
    """Fr, Ft, Fz (k, 3) N of the model, evaluated tool by tool. width (k,) mm, with arcs: radii of the tool."""
    if c.model is None:
        return np.zeros((len(motion), 3))
    feed, speed = path.feed[motion] if driven is None else driven, path.speed[motion]
    feed, speed = c.feeds(feed), np.where(speed > 0.0, speed, c.spindle_rpm or 0.0)
    tool = path.tool[motion]
    out = np.zeros((len(motion), 3))
    for number in np.unique(tool) if c.tools else [None]:
        at = np.flatnonzero(tool == number) if number is not None else slice(None)
        edges = c.edges(int(number)) if number is not None else Edges(c.diameter_mm, c.teeth)
        out[at] = c.model(
            Cut(
                tangent=direction[at],
                tool_axis=np.asarray(c.tool_axis, float),
                feed=feed[at],
                speed=speed[at],
                depth=depth[at],
                width=width[at] * (1.0 if arcs is None else 0.5 * (edges.diameter_mm or np.nan)),
                arc_length=s[at],
                line=path.line[motion[at]],
                diameter_mm=edges.diameter_mm,
                teeth=edges.teeth,
                to_machine=np.eye(3) if c.to_machine is None else c.to_machine,
                ends=ends[at],
                turn=path.turn[motion[at]],
                arcs=arcs if arcs is None or isinstance(at, slice) else arcs.take(at),
            )
        )
    return out


def base_of(path: Path, c: Conditions, engaged: Engaged, length: Floats) -> Floats:
    """Fr, Ft, Fz (k, 3) N of the model at the places of the engagement where the tool cuts, and at those next to them."""
    near = engaged.turn > 0.0
    on, beside = near.copy(), engaged.motion[1:] == engaged.motion[:-1]
    near[1:] |= on[:-1] & beside
    near[:-1] |= on[1:] & beside
    rows = np.flatnonzero(near)
    base = np.zeros((len(engaged.u), 3))
    if len(rows) and not c.plunges:
        where, u, arcs = engaged.motion[rows], engaged.u[rows], engaged.arcs.take(rows)
        direction = _in_tool_frame(path, where, u, path_geometry.tangents(path, where, u))
        s = np.concatenate(([0.0], np.cumsum(length)))[where] + u * length[where]
        base[rows] = _components(
            path=path,
            c=c,
            motion=where,
            direction=direction,
            depth=engaged.depth[rows],
            width=arcs.reach(len(rows)),
            s=s,
            ends=u == 1.0,
            arcs=arcs,
        )
    return base


def lay_track(path: Path, conditions: Conditions, engaged: Engaged | None = None) -> Track:
    """Pieces of a path with the loads at their corners. Raises the errors of the force model.

    engaged: engagement along the path, if it has been computed before.
    """
    length = path_geometry.lengths(path)
    axis = np.asarray(conditions.tool_axis, float)
    upright = Verticals.none() if conditions.model is None else Verticals.of(path, axis)
    if engaged is None and conditions.engage is not None and conditions.model is not None:
        engaged = conditions.engage(path)
    places = None
    if engaged is not None:
        base = base_of(path, conditions, engaged, length)
        rows = needed(engaged.motion, engaged.u, engaged.turn, engaged.bends, base)
        places, base = engaged.take(rows), base[rows]
    if conditions.model is None or not len(path):
        motion, u0, u1, over = whole_motions(path)
    else:
        motion, u0, u1, over = divide_motions(path, conditions.stock_top_mm, upright, places)
    beside0, beside1 = upright.beside(path, axis, motion, u0, u1)
    middle, feeding = 0.5 * (u0 + u1), (path.kind[motion] != RAPID) & path.known[motion] & ~path.machine[motion]
    first = path_geometry.tangents(path, motion, u0 + beside0)
    curved = bool((path.kind == ARC).any())  # lines have one direction from end to end
    last = path_geometry.tangents(path, motion, u1 - beside1) if curved else first
    sine = _sine(path, motion, u0, first, axis)
    if curved:
        sine = np.maximum(sine, _sine(path, motion, middle, path_geometry.tangents(path, motion, middle), axis))
    piece_length = length[motion] * (u1 - u0)
    cutting = feeding & (piece_length > 0.0) & ((sine > PLUNGE_SINE) | conditions.plunges)
    load, none = None, np.zeros((len(motion), 3))
    if places is not None:
        load = PieceLoad.of(places, base, motion, u0, u1)
        cutting &= load.on | (sine <= PLUNGE_SINE)
    elif conditions.stock_top_mm is not None:
        cutting &= path_geometry.points(path, motion, middle)[:, 2] < conditions.stock_top_mm
    track = Track(
        path=path, conditions=conditions, motion=motion, u0=u0, u1=u1, cutting=cutting, length=piece_length,
        s0=np.concatenate(([0.0], np.cumsum(length)))[motion] + length[motion] * u0,
        fade0=none, fade1=none, own0=none, own1=none, jump=np.zeros(len(motion), np.bool_), even=np.zeros(len(motion), np.bool_),
        corner=np.ones(len(motion), np.bool_), beside0=beside0, beside1=beside1, load=load, engaged=engaged,
    )  # fmt: skip
    return _cut_at_swings(_with_corners(track, first, last, over), upright)


def _sine(path: Path, motion: Ints, u: Floats, direction: Floats, axis: Floats) -> Floats:
    """Sine (p,) of the angle between feed directions (p, 3) and the tool axis, in the frame of a turning tool."""
    return lateral(_in_tool_frame(path, motion, u, direction), axis)


def _in_tool_frame(path: Path, motion: Ints, u: Floats, direction: Floats) -> Floats:
    """Directions (k, 3) as seen from the tool at fractions u (k,) of motions (k,)."""
    if path.orientation is None:
        return direction
    return np.asarray(np.einsum("kji,kj->ki", path.orientation.rotations(motion, u), direction))


def _with_corners(track: Track, first: Floats, last: Floats, over: Bools) -> Track:
    """The track with corner loads, jumps and stops; first, last (p, 3): directions at the ends of its pieces.

    over (p,): the direction across the tool reverses at the start of the piece.
    """
    n, rapid = len(track.motion), track.path.kind[track.motion] == RAPID
    own0, own1, even = _own_forces(track, first, last)
    before, bisector = np.empty(n, np.int64), np.empty((n, 3))
    corner, smooth, jump = np.empty((3, n), np.bool_)
    pieces = rapid, track.length
    find_corners(*pieces, track.cutting, over, first, last, np.cos(JOIN_ANGLE), before, corner, smooth, bisector)
    b = np.flatnonzero(smooth)
    a = before[b]
    ahead, fade0, fade1 = np.zeros((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    ahead[b] = track.force_along(a, np.ones(len(a)), bisector.take(b, axis=0))
    behind, other = ahead.copy(), b[_differ(track, a, b)]
    behind[other] = track.force_along(other, np.zeros(len(other)), bisector[other])
    share_loads(*pieces, before, smooth, own0, own1, ahead, behind, fade0, fade1, jump)
    return replace(track, own0=own0, own1=own1, even=even, fade0=fade0, fade1=fade1, jump=jump, corner=corner)


def _own_forces(track: Track, first: Floats, last: Floats) -> tuple[Floats, Floats, Bools]:
    """Model force (p, 3) N at both ends of pieces for directions (p, 3) there, and where it is linear between them."""
    c, n, path = track.conditions, len(track.motion), track.path
    every, straight = np.arange(n), path.kind[track.motion] != ARC
    own0 = track.force_along(every, np.zeros(n), first)
    if path.orientation is not None or c.plunges:
        return own0, track.force_along(every, np.ones(n), last), ~track.cutting
    if track.load is not None:  # linear between places of the engagement
        return own0, track.force_along(every, np.ones(n), last), straight | ~track.cutting
    level = c.depth_mm is not None or c.stock_top_mm is None
    if c.steady and level and straight.all():
        return own0, own0, straight
    even = straight & c.steady
    if not level:
        even &= path.start[track.motion, 2] == path.end[track.motion, 2]
    return own0, track.force_along(every, np.ones(n), last), even | ~track.cutting


def _differ(track: Track, a: Ints, b: Ints) -> Bools:
    """Whether the end of pieces a (k,) and the start of pieces b (k,) may have different forces in one direction."""
    path, c = track.path, track.conditions
    if not (c.steady and track.load is None and (c.depth_mm is not None or c.stock_top_mm is None)):
        return np.ones(len(a), np.bool_)
    out, first, second = np.zeros(len(a), np.bool_), track.motion[a], track.motion[b]
    for each in (path.feed, path.speed, path.turn, path.tool):
        if (each != each[:1]).any():
            out |= each[first] != each[second]
    return out


def _cut_at_swings(track: Track, upright: Verticals) -> Track:
    """Track with separate parts where the force changes direction quickly, so that other parts can be coarser."""
    motion, u = upright.swings(track.path)
    piece = np.searchsorted(track.motion + 0.5 * track.u0, motion + 0.5 * u, side="right") - 1
    u0, u1 = track.u0[piece], track.u1[piece]
    w = (u - u0) / (u1 - u0)
    inner = (w > 1e-6) & (w < 1.0 - 1e-6)
    return track.cut(piece[inner], w[inner]) if inner.any() else track


def _beside(track: Track, piece: Ints, w: Floats) -> Floats:
    """Fraction of the motion at which the direction at fraction w of the piece is taken."""
    return np.clip(track.u(piece, w), (track.u0 + track.beside0)[piece], (track.u1 - track.beside1)[piece])
