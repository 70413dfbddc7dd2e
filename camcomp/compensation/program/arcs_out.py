"""Arcs in the place of straight lines, where a corrected arc is followed by fewer moves that way.

An arc through both ends and the middle of a part of the commanded curve takes up all of its bending in the plane, so
only what bends along the path and along the axis is left to be divided for, as if the curve were that alone. What the
curvature changes within a part is of third order and is left to the check of the whole.
"""

from __future__ import annotations

import numpy as np

from camcomp.compensation.program.chords import SHARE, Nodes, divide
from camcomp.ground.datatypes import ARC, Bools, Floats, Ints
from camcomp.ground.records import dataclass
from camcomp.ground.vectors import sizes
from camcomp.model.cutting.track import Track

LARGEST = 2.0 * np.pi / 3.0  # rad, sweep of one arc; rounding moves the middle of longer ones too much
FLATTEST = 2.0  # steps of the resolution between arc and chord, below which an arc is a line
FEWER = 0.6  # of the moves that lines would take; blocks of arcs are longer


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


@dataclass(eq=False)
class Bend:
    """What pieces are divided for. use (p,): pieces that come out as arcs."""

    lines: Floats  # (k, 3) x'' at the trial nodes
    arcs: Floats  # (k, 3) the same without what an arc takes up
    sweep: Floats  # (p,) rad
    use: Bools
    straight: Ints  # (p,) moves that lines take

    @classmethod
    def of(cls, track: Track, trial: Nodes, commanded: Floats, second: Floats, tolerance: Floats, able: Bools) -> Bend:
        """Arcs for the pieces (p,) that are `able` and need few enough of them."""
        if not (able & (track.path.kind[track.motion] == ARC)).any():
            none = np.zeros(len(able))
            return cls(second, second, none, none > 0.0, none.astype(np.int64))
        axis = track.path.axis[track.motion][trial.piece]
        along = tangents(trial, commanded)
        side = np.cross(axis, along)
        side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-300)
        rest = second.copy()  # columns behind those of the tip bend with arcs as with lines
        rest[:, :3] -= np.sum(second[:, :3] * side, axis=1, keepdims=True) * side
        arc = track.path.kind[track.motion] == ARC
        sweep = np.where(arc, np.abs(np.nan_to_num(track.path.angle[track.motion])) * (track.u1 - track.u0), 0.0)
        bend = cls(second, rest, sweep, np.zeros(len(arc), np.bool_), np.zeros(len(arc), np.int64))
        bend.straight = np.diff(bend.divided(trial, tolerance)[0].first) - 1
        bend.use = able & arc
        bend.use &= ~bend.pointless(bend.divided(trial, tolerance)[0])
        return bend

    def pointless(self, nodes: Nodes) -> Bools:
        """Pieces (p,) with so many arcs that lines are as good."""
        return self.use & (np.diff(nodes.first) - 1 > FEWER * self.straight)

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
