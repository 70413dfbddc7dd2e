"""Where a piece of path must be divided so that lines or arcs between commanded tips keep within the tolerance.

A chord of the commanded curve x(w) over a step h misses it by |x''| h^2 / 8. Inner points are moved out by half of
that, so that the miss is shared by both sides: |x''| h^2 / 16. Steps that spend the tolerance evenly, h ~ |x''|^-1/2,
are the fewest. The two end steps of a piece keep one end in place and are END_STEP as long as inner ones.

A corrected arc is divided into arcs where those are fewer. An arc through both ends and the middle of a part of the commanded
curve takes up all of its bending in the plane, so only what bends along the path and along the axis is left to be divided
for, as if the curve were that alone. What the curvature changes within a part is of third order and is left to the check of
the whole.
"""

from __future__ import annotations

import numpy as np

from camcomp.ground.datatypes import ARC, Bools, Floats, Ints
from camcomp.ground.records import dataclass
from camcomp.ground.vectors import sizes
from camcomp.model.cutting.track import Track

END_STEP = 0.85  # largest miss of an end step = that of an inner one (0.062 against 0.0625 of |x''| h^2)
SHARE = 16.0  # inner step: miss = |x''| h^2 / SHARE
SINGLE = 8.0  # a piece in one step: both ends in place
COARSE_MM = 8.0  # distance of trial points on straight lines without effects
LARGEST = 2.0 * np.pi / 3.0  # rad, sweep of one arc; rounding moves the middle of longer ones too much
FLATTEST = 2.0  # steps of the resolution between arc and chord, below which an arc is a line
FEWER = 0.6  # of the moves that lines would take; blocks of arcs are longer


@dataclass(frozen=True, eq=False)
class Nodes:
    """Trial points: piece (k,) and w (k,), `first` (p + 1,) rows of every piece."""

    piece: Ints
    w: Floats
    first: Ints

    def among(self, others: Nodes) -> tuple[Ints, Ints]:
        """Which of others (m >= 1,) each node (k,) is, and the nodes that are none of them."""
        if self is others:
            return np.arange(len(self.w)), np.zeros(0, np.int64)
        known, own = 2.0 * others.piece + others.w, 2.0 * self.piece + self.w
        at = np.minimum(np.searchsorted(known, own), len(known) - 1)
        return at, np.flatnonzero(known[at] != own)


def begins_of(piece: Ints, w: Floats) -> Floats:
    """Fractions (k,) where the moves to points at fractions w (k,) of pieces begin: at the point before, or the piece."""
    return np.where(np.diff(piece, prepend=-1) == 0, np.append(0.0, w[:-1]), 0.0)


def trial_nodes(length: Floats, angle: Floats, divide: np.ndarray, spacing: float = COARSE_MM) -> Nodes:
    """At least three nodes where `divide`, one every `spacing` mm of length (p,) and 15 degrees of arc (p,); two elsewhere."""
    along = np.ceil(length / spacing) * (length > 0.25 * spacing)
    count = np.where(divide, 3 + along + np.ceil(np.abs(angle) / 0.26), 2)
    return even_nodes(count.astype(np.int64))


def even_nodes(count: Ints) -> Nodes:
    """So many nodes (p,) of every piece at even distances, its ends among them."""
    first = np.concatenate(([0], np.cumsum(count)))
    piece = np.repeat(np.arange(len(count)), count)
    k = np.arange(first[-1]) - first[piece]
    return Nodes(piece, k / np.maximum(count[piece] - 1, 1), first)


def second_derivative(nodes: Nodes, x: Floats) -> Floats:
    """x''(w) (k, c) at every node, from parabolas through three even-spaced neighbours; x (k, c) mm."""
    second = np.zeros_like(x)
    if len(nodes.w) == 2 * (len(nodes.first) - 1):
        return second
    count = np.diff(nodes.first)[nodes.piece]
    second[1:-1] = x[2:] - 2.0 * x[1:-1] + x[:-2]
    k = np.arange(len(nodes.w)) - nodes.first[nodes.piece]
    rows = np.arange(len(k)) + (k == 0) - (k == count - 1)
    second = second[np.clip(rows, 0, len(k) - 1)] * ((count - 1.0) ** 2)[:, None]
    return np.where((count < 3)[:, None], 0.0, second)


def divide(nodes: Nodes, second: Floats, tolerance: Floats, least: Floats | None = None) -> tuple[Nodes, Floats]:
    """Division points of every piece for a tolerance (p,) mm, and the shift (k, c) mm that shares the miss.

    second (k, c): x'' at the trial nodes. least (p,): |x''|^(1/2) counts as at least that much. The ends of a piece are
    included and never shifted.
    """
    if not len(tolerance):
        return nodes, np.zeros((0, second.shape[1]))
    floor = np.zeros(len(tolerance)) if least is None else least
    g = np.maximum(np.sqrt(sizes(second)), floor[nodes.piece])
    dw = np.diff(nodes.w)
    area = np.concatenate(([0.0], np.cumsum(np.where(dw > 0.0, 0.5 * (g[1:] + g[:-1]) * dw, 0.0))))
    start = area[nodes.first[:-1]]
    total = area[nodes.first[1:] - 1] - start  # (p,) integral of |x''|^(1/2) over the piece
    slack = 2.0 * (1.0 - END_STEP)
    count = np.maximum(np.ceil(total / np.sqrt(SHARE * tolerance) + slack - 1e-9).astype(np.int64), 2)
    count[total <= np.sqrt(SINGLE * tolerance)] = 1
    out = even_nodes(count + 1)
    n = count[out.piece]
    k = np.arange(len(out.w)) - out.first[out.piece]
    inner = (k > 0) & (k < n)
    # invert the running integral inside each piece; the offsets keep neighbouring pieces apart
    goal = start[out.piece] + (k - (1.0 - END_STEP)) / np.maximum(n - slack, 1.0) * total[out.piece]
    w = np.interp(goal + 1e-9 * out.piece, area + 1e-9 * nodes.piece, nodes.w + 2.0 * nodes.piece) - 2.0 * out.piece
    w = np.where(inner, np.clip(w, 0.0, 1.0), np.where(k == 0, 0.0, 1.0))
    key, at = nodes.w + 2.0 * nodes.piece, w + 2.0 * out.piece
    bend = np.stack([np.interp(at, key, each) for each in second.T], axis=1)
    size = np.maximum(sizes(bend), floor[out.piece] ** 2)
    miss = (total[out.piece] / np.maximum(n - slack, 1.0)) ** 2 / SHARE  # |x''| h^2 / SHARE, the same at every step
    shift = np.where((inner & (size > 0.0))[:, None], -bend * (miss / np.maximum(size, 1e-300))[:, None], 0.0)
    return Nodes(out.piece, w, out.first), shift


def tangents(nodes: Nodes, x: Floats) -> Floats:
    """x'(w) (k, 3) at every node, up to a factor, from parabolas through three neighbours."""
    count = np.diff(nodes.first)[nodes.piece]
    k = np.arange(len(nodes.w)) - nodes.first[nodes.piece]
    middle = np.clip(np.arange(len(k)) + (k == 0) - (k == count - 1), 1, max(len(k) - 2, 1))
    if len(k) < 3:
        return np.zeros_like(x)
    first = 0.5 * (x[middle + 1] - x[middle - 1])
    second = x[middle + 1] - 2.0 * x[middle] + x[middle - 1]
    side = ((k == count - 1).astype(float) - (k == 0))[:, None]
    return np.where((count < 3)[:, None], 0.0, first + side * second)


class Bend:
    """What pieces (p,) are divided for: lines, or arcs where those are few enough."""

    def __init__(
        self, track: Track, trial: Nodes, *, commanded: Floats, second: Floats, tolerance: Floats, able: Bools
    ) -> None:
        """Commanded (k, 3), second (k, c): tips at the trial nodes and their x''. able (p,): pieces that may become arcs."""
        arc = track.path.kind[track.motion] == ARC
        self.lines = self.arcs = second  # (k, c) x'' at the trial nodes, and without what an arc takes up
        self.sweep = np.where(arc, np.abs(np.nan_to_num(track.path.angle[track.motion])) * (track.u1 - track.u0), 0.0)
        self.use = np.zeros(len(arc), np.bool_)  # pieces that come out as arcs
        if not (able & arc).any():
            return
        side = np.cross(track.path.axis[track.motion][trial.piece], tangents(trial, commanded))
        side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-300)
        self.arcs = second.copy()  # columns behind those of the tip bend with arcs as with lines
        self.arcs[:, :3] -= np.sum(second[:, :3] * side, axis=1, keepdims=True) * side
        self.straight = np.diff(self.divided(trial, tolerance)[0].first) - 1  # moves that lines take
        self.use = able & arc
        self.use &= ~self.pointless(self.divided(trial, tolerance)[0])

    def pointless(self, nodes: Nodes) -> Bools:
        """Pieces (p,) with so many arcs that lines are as good."""
        return self.use & (np.diff(nodes.first) - 1 > FEWER * self.straight) if self.use.any() else self.use

    def divided(self, trial: Nodes, tolerance: Floats) -> tuple[Nodes, Floats]:
        """Division points and their shifts."""
        if len(trial.w) == 2 * len(tolerance) and not self.use.any():
            return trial, np.zeros_like(self.lines)
        second = np.where(self.use[trial.piece][:, None], self.arcs, self.lines)
        fewest = np.where(self.use, np.ceil(self.sweep / LARGEST - 1e-9), 0.0)
        least = np.where(fewest > 1.0, fewest * np.sqrt(SHARE * np.minimum(tolerance, 1.0)), 0.0)
        return divide(trial, second, tolerance, least)


def through(start: Floats, middle: Floats, end: Floats, axis: Floats, way: Floats, flat: float) -> tuple[Floats, Bools]:
    """Centres (k, 3) of arcs through three points each (k, 3) about axes (k, 3), way (k,) > 0 counter-clockwise.

    NaN where the arc is not `flat` mm from its chord. The second result says which ones turn the wrong way.
    """

    def level(vector: Floats) -> Floats:
        out: Floats = vector - np.sum(vector * axis, axis=1, keepdims=True) * axis
        return out

    a, b = level(end - start), level(middle - start)
    area = np.sum(axis * np.cross(b, a), axis=1)  # > 0: counter-clockwise
    chord = sizes(a)
    bent = np.abs(area) > flat * np.maximum(chord, 1e-12)
    wrong = bent & (area * way <= 0.0)
    good = bent & ~wrong
    double = np.where(good, -2.0 * area, 1.0)[:, None]
    square_a, square_b = np.sum(a**2, axis=1, keepdims=True), np.sum(b**2, axis=1, keepdims=True)
    radius = (square_b * np.cross(axis, a) - square_a * np.cross(axis, b)) / double  # from the start to the centre
    return np.where(good[:, None], start + radius, np.nan), wrong


def sweeps(start: Floats, end: Floats, centre: Floats, axis: Floats, way: Floats) -> Floats:
    """Signed angles (k,) rad below a full circle."""
    p, q = start - centre, end - centre
    sine, cosine = np.sum(axis * np.cross(p, q), axis=1), np.sum(p * q, axis=1)
    cosine -= np.sum(p * axis, axis=1) * np.sum(q * axis, axis=1)
    angle = np.arctan2(sine, cosine)
    out: Floats = np.where(way > 0.0, np.mod(angle, 2.0 * np.pi), -np.mod(-angle, 2.0 * np.pi))
    return out


def middles(nodes: Nodes, use: Bools) -> tuple[Nodes, Bools]:
    """The nodes with one more in the middle of every step of the pieces in use, and which ones those are."""
    step = np.flatnonzero((np.diff(nodes.piece) == 0) & use[nodes.piece[1:]])
    if not len(step):
        return nodes, np.zeros(len(nodes.w), np.bool_)
    k = np.concatenate((np.arange(len(nodes.w)), step + 0.5))
    order = np.argsort(k, kind="stable")
    w = np.concatenate((nodes.w, 0.5 * (nodes.w[step] + nodes.w[step + 1])))[order]
    piece = np.concatenate((nodes.piece, nodes.piece[step]))[order]
    first = np.searchsorted(piece, np.arange(len(nodes.first)))
    return Nodes(piece, w, first), (order >= len(nodes.w))
