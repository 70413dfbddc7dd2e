"""A path as straight legs, with the directions of the feed at their ends."""

from __future__ import annotations

import numpy as np

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, RAPID, Bools, Floats, Ints, Path
from camcomp.ground.records import dataclass
from camcomp.model.cutting.track import JOIN_ANGLE, PLUNGE_SINE
from camcomp.model.stock.places import CUT_LEG, PLUNGE_LEG, RAPID_LEG, UNSEEN_LEG

SAGITTA_MM = 5e-4  # by which a chord may miss its arc
MOST_CHORDS = 20_000


@dataclass(frozen=True, eq=False, kw_only=True)
class Legs:
    """Straight legs (m,) of the motions of a path that have a length."""

    motion: Ints
    u0: Floats
    u1: Floats
    kind: Ints
    table: Floats  # (m, 10), columns of places.py
    joined: Bools  # (m + 1,) no corner between a leg and the one before
    ends: Floats  # (m, 3) direction in which a leg ends


@dataclass(frozen=True, eq=False)
class LegBefore:
    """The last leg before a path."""

    known: bool = False  # whether the position is known
    end: Floats | None = None  # (3,) direction in which it ends, if it cuts
    tool: int = -1


def legs_of(path: Path, before: LegBefore) -> Legs:
    """The legs of a path."""
    arcs = bool((path.kind == ARC).any())
    motion, u0, u1 = _chords(path) if arcs else (np.arange(len(path)), np.zeros(len(path)), np.ones(len(path)))
    start, end = path.start, path.end
    if arcs:
        start, end = path_geometry.points(path, motion, u0), path_geometry.points(path, motion, u1)
    chord = end - start
    length = np.sqrt(np.einsum("ij,ij->i", chord, chord))
    reached = np.concatenate(([before.known], path.known[:-1] & ~path.machine[:-1]))
    seen = path.known & ~path.machine
    kind = np.where(path.kind == RAPID, np.where(seen & reached, RAPID_LEG, UNSEEN_LEG), CUT_LEG)[motion]
    steep = np.hypot(chord[:, 0], chord[:, 1]) <= PLUNGE_SINE * length
    kind = np.where((kind == CUT_LEG) & steep, PLUNGE_LEG, kind)
    kind = np.where(seen[motion], kind, UNSEEN_LEG)
    on = np.flatnonzero((length > 0.0) | (kind == UNSEEN_LEG))
    motion, kind = motion[on], kind[on]
    if len(on) < len(length):
        u0, u1, start, end, chord = (each[on] for each in (u0, u1, start, end, chord))
    first = path_geometry.tangents(path, motion, u0)
    last = path_geometry.tangents(path, motion, u1) if arcs else first.copy()
    ends = last.copy()
    joined = np.zeros(len(motion) + 1, np.bool_)
    if len(motion):
        cuts, tool = kind == CUT_LEG, path.tool[motion]
        straight = np.sum(last[:-1] * first[1:], axis=1) >= np.cos(JOIN_ANGLE)
        joined[1:-1] = cuts[:-1] & cuts[1:] & (tool[:-1] == tool[1:]) & straight
        if before.end is not None and cuts[0] and before.tool == tool[0]:
            joined[0] = before.end @ first[0] >= np.cos(JOIN_ANGLE)
            first[0] += before.end if joined[0] else 0.0
    both = np.flatnonzero(joined[1:-1]) if len(motion) else np.zeros(0, np.int64)
    middle = last[both] + first[both + 1]
    last[both], first[both + 1] = middle, middle
    table = np.concatenate((start, end, _level(first, chord), _level(last, chord)), axis=1)
    return Legs(motion=motion, u0=u0, u1=u1, kind=kind, table=table, joined=joined, ends=ends)


def _chords(path: Path) -> tuple[Ints, Floats, Floats]:
    """Motions in parts: arcs in chords, everything else whole."""
    arc = path.kind == ARC
    radius = np.where(arc, np.linalg.norm(np.where(arc[:, None], path.start - path.centre, 1.0), axis=1), 1.0)
    last = np.where(arc, np.linalg.norm(np.where(arc[:, None], path.end - path.centre, 1.0), axis=1), 1.0)
    step = np.sqrt(8.0 * SAGITTA_MM / np.maximum(np.maximum(radius, last), 8.0 * SAGITTA_MM))
    count = np.where(arc, np.clip(np.ceil(np.abs(np.nan_to_num(path.angle)) / step), 1, MOST_CHORDS), 1).astype(
        np.int64
    )
    motion = np.repeat(np.arange(len(path)), count)
    k = np.arange(len(motion)) - np.repeat(np.cumsum(count) - count, count)
    return motion, k / count[motion], (k + 1) / count[motion]


def _level(direction: Floats, chord: Floats) -> Floats:
    """Unit directions (m, 2) in the plane; that of the chord where there is none."""
    flat = direction[:, :2]
    size = np.hypot(flat[:, 0], flat[:, 1])
    level = size <= 1e-6
    if level.any():
        flat = np.where(level[:, None], chord[:, :2], flat)
        size = np.hypot(flat[:, 0], flat[:, 1])
    out: Floats = np.divide(flat, size[:, None], out=np.tile([1.0, 0.0], (len(flat), 1)), where=size[:, None] > 0.0)
    return out
