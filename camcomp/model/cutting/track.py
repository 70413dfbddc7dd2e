"""The path cut into pieces of one kind of load, and the cutting force at any point of a piece.

A piece is a motion, or the part of a motion on one side of the stock's top, or of the point where an arc passes the
vertical and the direction across the tool turns over. Rapids and air moves carry no force, and
plunges none unless the force model says otherwise. Where two cutting pieces meet at less than JOIN_ANGLE the corner
takes the force of the bisecting direction and the difference fades linearly along the pieces; where they meet at more,
where a cut starts or ends, and where the model gives both sides different forces in one direction (another feed, speed
or sense of the spindle, another tool, a step of a table) the force jumps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, RAPID, Bools, Floats, Ints, Path
from camcomp.model.cutting.cut import Cut
from camcomp.model.cutting.frame import lateral, to_vector
from camcomp.model.cutting.upright import Verticals

JOIN_ANGLE = np.radians(5.0)
PLUNGE_SINE = (
    5e-3  # of the angle between feed and tool axis: corrected plunges slant by some 1e-4, rounded short ones too
)
NO_FORCE = 1e-9  # N
SAME_FORCE = 1e-6  # of the force: lengths of the path are rounded sums, and a table is looked up by them


@dataclass(frozen=True, eq=False)
class Conditions:
    """What the program does not say about the cut. model: Cut -> (Fr, Ft, Fz) (k, 3) N, None = no force."""

    model: Callable[[Cut], Floats] | None
    plunges: bool = False
    tool_axis: Floats = (0.0, 0.0, 1.0)  # type: ignore[assignment]  # program frame, away from the workpiece
    stock_top_mm: float | None = None
    depth_mm: float | None = None
    width_mm: float | None = None
    spindle_rpm: float | None = None
    feed_mm_per_min: float | None = None
    diameter_mm: float | None = None
    teeth: int | None = None
    to_machine: Floats | None = None


@dataclass(frozen=True, eq=False)
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
    beside0: Floats  # fraction of the motion behind the start of the piece where the direction is that farther in
    beside1: Floats  # the same in front of its end

    @property
    def angle(self) -> Floats:
        """(p,) rad, part of the arc; 0 where the motion is none."""
        angle = self.path.angle[self.motion]
        return np.where(np.isnan(angle), 0.0, angle) * (self.u1 - self.u0)

    def u(self, piece: Ints, w: Floats) -> Floats:
        """Fraction of the motion at fraction w of the piece."""
        return np.where(w == 1.0, self.u1[piece], self.u0[piece] + w * (self.u1[piece] - self.u0[piece]))

    def points(self, piece: Ints, w: Floats) -> Floats:
        """Programmed tip (k, 3) mm at fraction w (k,) of piece (k,)."""
        return path_geometry.points(self.path, self.motion[piece], self.u(piece, w))

    def cut(self, piece: Ints, w: Floats) -> Track:
        """The same track with pieces cut at fractions w (k,), inside, of pieces (k,): the load of a piece fades linearly."""
        n = len(self.motion)
        of = np.concatenate((np.arange(n), piece))
        begin = np.concatenate((np.zeros(n), w))
        order = np.lexsort((begin, of))
        of, begin = of[order], begin[order]
        end = np.where(np.append(of[1:] == of[:-1], False), np.append(begin[1:], 1.0), 1.0)
        inner = begin > 0.0
        a, b = self.fade0[of], self.fade1[of]
        return replace(
            self, motion=self.motion[of], u0=self.u(of, begin), u1=self.u(of, end), cutting=self.cutting[of],
            length=(end - begin) * self.length[of], s0=self.s0[of] + begin * self.length[of],
            fade0=a + begin[:, None] * (b - a), fade1=a + end[:, None] * (b - a), jump=self.jump[of] & ~inner,
            corner=self.corner[of] & ~inner, beside0=np.where(inner, 0.0, self.beside0[of]),
            beside1=np.where(end < 1.0, 0.0, self.beside1[of]),
        )  # fmt: skip

    def force(self, piece: Ints, w: Floats) -> Floats:
        """Cutting force on the tool (k, 3) N, program frame."""
        tangent = path_geometry.tangents(self.path, self.motion[piece], _beside(self, piece, w))
        out = _force(self.path, self.conditions, self.cutting, self.motion, self.s0, self.length, piece, w, tangent,
                     self.points(piece, w))  # fmt: skip
        return out + (1.0 - w)[:, None] * self.fade0[piece] + w[:, None] * self.fade1[piece]

    def force_along(self, piece: Ints, w: Floats, direction: Floats) -> Floats:
        """Cutting force on the tool (k, 3) N, program frame, where the tip is driven along unit vectors direction (k, 3)."""
        return _force(self.path, self.conditions, self.cutting, self.motion, self.s0, self.length, piece, w, direction,
                      self.points(piece, w))  # fmt: skip


def _force(
    path: Path, c: Conditions, cutting: Bools, motion: Ints, s0: Floats, length: Floats, piece: Ints, w: Floats,
    direction: Floats, tip: Floats,
) -> Floats:  # fmt: skip
    """Model force (k, 3) N for given feed directions, program frame."""
    out = np.zeros((len(piece), 3))
    on = cutting[piece] & (np.linalg.norm(direction, axis=1) > 0.0)
    if c.model is None or not on.any():
        return out
    rows = motion[piece[on]]
    fill = np.full(len(rows), np.nan)
    depth = fill if c.depth_mm is None else np.full(len(rows), c.depth_mm)
    if c.depth_mm is None and c.stock_top_mm is not None:
        depth = c.stock_top_mm - tip[on][:, 2]
    feed, speed = path.feed[rows], path.speed[rows]
    cut = Cut(
        tangent=direction[on],
        tool_axis=np.asarray(c.tool_axis, float),
        feed=np.where(np.isnan(feed), c.feed_mm_per_min or np.nan, feed),
        speed=np.where(speed > 0.0, speed, c.spindle_rpm or 0.0),
        depth=depth,
        width=fill if c.width_mm is None else np.full(len(rows), c.width_mm),
        arc_length=s0[piece[on]] + w[on] * length[piece[on]],
        line=path.line[rows],
        diameter_mm=c.diameter_mm,
        teeth=c.teeth,
        to_machine=np.eye(3) if c.to_machine is None else c.to_machine,
        ends=w[on] == 1.0,
        turn=path.turn[rows],
    )
    out[on] = to_vector(c.model(cut), cut.tangent, cut.tool_axis)
    return out


def lay_track(path: Path, conditions: Conditions, length: Floats | None = None) -> Track:
    """Pieces of a path with the loads at their corners. Raises what the force model raises."""
    length = path_geometry.lengths(path) if length is None else length
    axis = np.asarray(conditions.tool_axis, float)
    upright = Verticals.none() if conditions.model is None else Verticals.of(path, axis)
    motion, u0, u1, over = _pieces(path, conditions, upright)
    beside0, beside1 = upright.beside(path, axis, motion, u0, u1)
    n = len(motion)
    piece_length = length[motion] * (u1 - u0)
    s0 = np.concatenate(([0.0], np.cumsum(length)))[motion] + length[motion] * u0
    middle = 0.5 * (u0 + u1)
    first = path_geometry.tangents(path, motion, u0 + beside0)
    last = path_geometry.tangents(path, motion, u1 - beside1)
    feeding = (path.kind[motion] != RAPID) & path.known[motion] & ~path.machine[motion] & (piece_length > 0.0)
    sine = np.maximum(lateral(first, axis), lateral(path_geometry.tangents(path, motion, middle), axis))
    cutting = feeding & ((sine > PLUNGE_SINE) | conditions.plunges)
    if conditions.stock_top_mm is not None:
        cutting &= path_geometry.points(path, motion, middle)[:, 2] < conditions.stock_top_mm

    def force(piece: Ints, w: Floats, direction: Floats) -> Floats:
        tip = path_geometry.points(path, motion[piece], np.where(w == 0.0, u0[piece], u1[piece]))
        return _force(path, conditions, cutting, motion, s0, piece_length, piece, w, direction, tip)

    every = np.arange(n)
    own0, own1 = force(every, np.zeros(n), first), force(every, np.ones(n), last)
    fade0, fade1 = np.zeros((n, 3)), np.zeros((n, 3))
    jump = np.zeros(n, np.bool_)
    rapid = path.kind[motion] == RAPID
    real = np.flatnonzero((piece_length > 0.0) | rapid)
    a, b = real[:-1], real[1:]
    cosine = np.clip(np.sum(last[a] * first[b], axis=1), -1.0, 1.0)
    straight_on = ~rapid[a] & ~rapid[b] & (cosine >= np.cos(JOIN_ANGLE))
    corner = np.ones(n, np.bool_)
    corner[b] = ~straight_on
    smooth = cutting[a] & cutting[b] & straight_on & ~over[b]
    bisector = np.where(smooth[:, None], last[a] + first[b], 0.0)
    bisector /= np.maximum(np.linalg.norm(bisector, axis=1, keepdims=True), 1e-300)
    ahead, behind = force(a, np.ones(len(a)), bisector), force(b, np.zeros(len(b)), bisector)
    smooth &= np.linalg.norm(behind - ahead, axis=1) <= SAME_FORCE * np.linalg.norm(ahead, axis=1) + NO_FORCE
    jump[b] = ~smooth & (np.linalg.norm(own0[b] - own1[a], axis=1) > NO_FORCE)
    if len(real) and real[0] > 0:  # moves without length stand before the first cut
        jump[real[0]] = bool(np.linalg.norm(own0[real[0]]) > NO_FORCE)
    a, b = a[smooth], b[smooth]
    shared = 0.5 * (ahead + behind)[smooth]
    fade1[a] = shared - own1[a]
    fade0[b] = shared - own0[b]
    _carry_over((piece_length > 0.0) | rapid, own1 + fade1, fade0, fade1)
    track = Track(
        path, conditions, motion, u0, u1, cutting, piece_length, s0, fade0, fade1, jump, corner, beside0, beside1
    )
    return _cut_at_swings(track, upright)


def _cut_at_swings(track: Track, upright: Verticals) -> Track:
    """The track with parts of their own where the force turns round quickly, so that other parts need not be as fine."""
    motion, u = upright.swings(track.path)
    piece = np.searchsorted(track.motion + 0.5 * track.u0, motion + 0.5 * u, side="right") - 1
    u0, u1 = track.u0[piece], track.u1[piece]
    w = (u - u0) / (u1 - u0)
    inner = (w > 1e-6) & (w < 1.0 - 1e-6)
    return track.cut(piece[inner], w[inner]) if inner.any() else track


def _carry_over(moves: Bools, end_force: Floats, fade0: Floats, fade1: Floats) -> None:
    """A feed motion without length keeps the force of the piece before it."""
    before = np.maximum.accumulate(np.where(moves, np.arange(len(moves)), -1))
    still = np.flatnonzero(~moves & (before >= 0))
    fade0[still] = fade1[still] = end_force[before[still]]


def _beside(track: Track, piece: Ints, w: Floats) -> Floats:
    """Fraction of the motion at which the direction at fraction w of the piece is taken."""
    return np.clip(track.u(piece, w), (track.u0 + track.beside0)[piece], (track.u1 - track.beside1)[piece])


def _pieces(path: Path, conditions: Conditions, upright: Verticals) -> tuple[Ints, Floats, Floats, Bools]:
    """Every motion once, or in parts where a feed motion crosses the stock's top or an arc passes the vertical.

    The last result says which parts begin at the vertical.
    """
    n = len(path)
    whole = np.arange(n), np.zeros(n), np.ones(n), np.zeros(n, np.bool_)
    if conditions.model is None or n == 0:
        return whole
    over = upright.overturns(path)
    cuts = sorted({*over, *_crossings(path, conditions.stock_top_mm)})
    if not cuts:
        return whole
    motion = np.concatenate((whole[0], [i for i, _ in cuts]))
    u0 = np.concatenate((whole[1], [at for _, at in cuts]))
    order = np.lexsort((u0, motion))
    motion, u0 = motion[order], u0[order]
    u1 = np.ones(len(u0))
    same = motion[1:] == motion[:-1]
    u1[:-1][same] = u0[1:][same]
    begins = {*over}
    return motion, u0, u1, np.array([(int(i), float(u)) in begins for i, u in zip(motion, u0, strict=True)], np.bool_)


def _crossings(path: Path, top: float | None) -> list[tuple[int, float]]:
    """Feed motions and fractions at which they cross the stock's top."""
    if top is None:
        return []
    u = np.linspace(0.0, 1.0, 65)
    moves = np.flatnonzero((path.kind != RAPID) & path.known & ~path.machine)
    below = (path.start[moves, 2] < top, path.end[moves, 2] < top)
    flat = np.abs(path.axis[moves, 2]) == 1.0  # an arc in the XY plane climbs steadily, if at all
    crossing = moves[(below[0] != below[1]) | ((path.kind[moves] == ARC) & ~flat)]
    cuts: list[tuple[int, float]] = []
    for i in crossing:
        row = np.full(len(u), i)
        height = path_geometry.points(path, row, u)[:, 2] - top
        for k in np.flatnonzero((height[:-1] < 0.0) != (height[1:] < 0.0)):
            cuts.append((int(i), _crossing(path, int(i), u[k], u[k + 1], top)))
    return [(i, at) for i, at in cuts if 1e-9 < at < 1.0 - 1e-9]


def _crossing(path: Path, motion: int, a: float, b: float, height: float) -> float:
    """Bisects for the fraction at which a motion passes a height."""
    row = np.array([motion])
    below = path_geometry.points(path, row, np.array([a]))[0, 2] < height
    for _ in range(60):
        middle = 0.5 * (a + b)
        if (path_geometry.points(path, row, np.array([middle]))[0, 2] < height) == below:
            a = middle
        else:
            b = middle
    return 0.5 * (a + b)
