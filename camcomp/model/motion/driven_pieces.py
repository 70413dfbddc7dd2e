"""Pieces with nodes of a logged run, and the loads at which the structure is solved there.

Pieces end where the force jumps; rows with a force far from that of their neighbours, as in blended corners, have pieces
of their own.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.records import dataclass, replace
from camcomp.model.motion.node_pieces import NODES, SPLIT, Places, basis_at

_PIECE_MM = 60.0
_PIECE_RAD = np.pi / 3
# of a load along a piece, and rows for it; the cubic misses 60 degrees of an arc by 4e-4 of it
_DEGREES = ((0, 1), (1, 2), (3, 7))
_CORNER = 0.1  # of the largest force: difference from the polynomial beyond which first derivatives do not suffice
_EVEN = 1e-3  # of the largest force: median residual below which the lower degree suffices
_LARGER = 1.01  # times the largest force: bound of an extrapolated load
_REWEIGHTED = 12


@dataclass(frozen=True, eq=False)
class DrivenPieces:
    """p consecutive pieces of a run: start and end (p,) s, path length of the tip on the grid."""

    begin: Floats
    end: Floats
    grid: Floats
    way: Floats  # (g,) mm, path length of the tip
    stretch: NDArray[np.int64]  # (p,) number of the interval between jumps of the force

    @classmethod
    def along(cls, time: Floats, grid: Floats, tip: Floats, jump: Ints) -> DrivenPieces:
        """Pieces of a run with rows at times (n,) s and jumps of the force after some; tip (g, 3) mm on the grid (g,) s."""
        step = np.diff(tip, axis=0)
        length = np.linalg.norm(step, axis=1)
        way = np.concatenate([[0.0], np.cumsum(length)])
        moves = np.flatnonzero(length > 1e-6)
        unit = step / np.where(length > 1e-6, length, 1.0)[:, None]
        turn = np.zeros(len(grid))
        if len(moves) > 1:
            cosine = np.clip(np.sum(unit[moves[1:]] * unit[moves[:-1]], axis=1), -1.0, 1.0)
            np.add.at(turn, moves[1:], np.arccos(cosine))
        turned = np.cumsum(turn)
        edges = np.unique(np.concatenate([[time[0]], 0.5 * (time[jump] + time[jump + 1]), [time[-1]]]))
        begin: list[float] = []
        stretch: list[int] = []
        for s, (a, b) in enumerate(pairwise(edges)):
            i, j = np.searchsorted(grid, (a, b))
            i, j = min(i, len(grid) - 1), min(j, len(grid) - 1)
            effort = (way[i : j + 1] - way[i]) / _PIECE_MM + (turned[i : j + 1] - turned[i]) / _PIECE_RAD
            count = max(int(np.ceil(effort[-1] if len(effort) else 0.0)), 1)
            inner = [float(np.interp(effort[-1] * m / count, effort, grid[i : j + 1])) for m in range(1, count)]
            cuts = [float(a), *(each for each in inner if a < each < b)]
            begin += cuts
            stretch += [s] * len(cuts)
        start = np.array(begin)
        return cls(start, np.append(start[1:], time[-1]), grid, way, np.array(stretch))

    def around(self, time: Floats, rows: Bools) -> DrivenPieces:
        """Pieces with separate ones for consecutive rows of a mask (n,)."""
        changes = np.flatnonzero(rows[1:] != rows[:-1])
        right = np.clip(np.searchsorted(time, self.begin), 1, len(time) - 1)
        new_stretch = np.diff(self.stretch, prepend=-1) > 0
        kept = self.begin[new_stretch | ~(rows[right - 1] & rows[right])]
        begin = np.unique(np.concatenate([kept, 0.5 * (time[changes] + time[changes + 1])]))
        return replace(self, begin=begin, end=np.append(begin[1:], time[-1]), stretch=self.stretch[self.of(begin)])

    def of(self, at: Floats) -> Ints:
        """Piece (n,) at times (n,)."""
        return np.clip(np.searchsorted(self.begin, at, side="right") - 1, 0, len(self.begin) - 1)

    def local(self, piece: Ints, at: Floats) -> Floats:
        """Fraction (n,) of the piece: of its path length, or of its time at standstill."""
        first, last = np.interp(self.begin, self.grid, self.way), np.interp(self.end, self.grid, self.way)
        way = (last - first)[piece]
        moved = (np.interp(at, self.grid, self.way) - first[piece]) / np.where(way > 1e-3, way, 1.0)
        spent = (at - self.begin[piece]) / np.maximum((self.end - self.begin)[piece], 1e-9)
        return np.clip(np.where(way > 1e-3, moved, spent), 0.0, 1.0)

    def at(self, at: Floats) -> Places:
        """Interpolation between the nodes at times (n,)."""
        piece = self.of(at)
        return Places(piece, piece[:, None] * NODES + np.arange(NODES), basis_at(self.local(piece, at)))

    def node_times(self) -> Floats:
        """Times (q,) of the nodes."""
        out = []
        for a, b in zip(self.begin, self.end, strict=True):
            inside = (self.grid > a) & (self.grid < b)
            t = np.concatenate([[a], self.grid[inside], [b]])
            way = np.interp(t, self.grid, self.way)
            done = (way - way[0]) / (way[-1] - way[0]) if way[-1] - way[0] > 1e-3 else (t - a) / max(b - a, 1e-9)
            out.append(np.interp(SPLIT, done, t))
        return np.concatenate(out)


def node_loads(time: Floats, force: Floats, sure: Bools, jump: Ints, at: Floats, pieces: DrivenPieces) -> Floats:
    """Loads (q, 3) N of the structure at node times (q,): a robust low-degree polynomial of the sure rows of each piece.

    First derivatives add the difference to the force (n, 3) of a row. A polynomial through all rows would oscillate between
    nodes where a piece begins or ends in a corner.
    """
    out = _of_stretches(time=time, values=force, sure=sure, jump=jump, at=at, pieces=pieces)
    piece, most = pieces.of(time), float(np.linalg.norm(force, axis=1).max(initial=0.0))
    local = pieces.local(piece, time)
    order = np.argsort(piece[sure], kind="stable")
    rows = np.flatnonzero(sure)[order]
    for mine in np.split(rows, np.flatnonzero(np.diff(piece[rows])) + 1):
        if not len(mine):
            continue
        for degree in (d for d, fewest in _DEGREES if len(mine) >= fewest):
            smooth, off = _mostly(local[mine], force[mine], degree)
            if off <= _EVEN * most:
                break
        if np.linalg.norm(smooth, axis=1).max() <= _LARGER * most:
            out[piece[mine[0]] * NODES + np.arange(NODES)] = smooth
    return out


def near_largest_change(time: Floats, force: Floats, sure: Bools, jump: Ints, pieces: DrivenPieces) -> Bools:
    """Mask (n,) of sure rows with a force far from the polynomial of their piece, as in a blended corner."""
    loads = node_loads(time=time, force=force, sure=sure, jump=jump, at=pieces.node_times(), pieces=pieces)
    off = np.linalg.norm(force - pieces.at(time).of(loads), axis=1)
    return np.asarray(sure & (off > _CORNER * float(np.linalg.norm(force, axis=1).max(initial=0.0))))


def _mostly(at: Floats, values: Floats, degree: int) -> tuple[Floats, float]:
    """Polynomial of values (n, 3) at positions (n,) from 0 to 1 by least absolute deviations, and its median residual.

    Returns values at the nodes (NODES, 3). Source: iteratively reweighted least squares (Schlossmacher 1973).
    """
    ways, at_nodes = np.vander(2.0 * at - 1.0, degree + 1), np.vander(2.0 * SPLIT - 1.0, degree + 1)
    weight = np.ones(len(at))
    for _ in range(_REWEIGHTED):
        found = np.linalg.lstsq(weight[:, None] * ways, weight[:, None] * values, rcond=None)[0]
        off = np.linalg.norm(values - ways @ found, axis=1)
        weight = 1.0 / np.sqrt(np.maximum(off, 1e-3 * float(off.max(initial=0.0)) + 1e-9))
    return at_nodes @ found, float(np.median(off))


def _of_stretches(time: Floats, values: Floats, sure: Bools, jump: Ints, at: Floats, pieces: DrivenPieces) -> Floats:
    """Values (n, 3) at node times (q,), interpolated between the sure rows (n,) of the node's own interval."""
    edge = np.concatenate([[0], jump + 1, [len(time)]])
    stretch = np.repeat(pieces.stretch, NODES)
    out = np.empty((len(at), values.shape[1]))
    for s in np.unique(stretch):
        every, mine = np.arange(edge[s], edge[s + 1]), stretch == s
        rows = every[sure[every]] if sure[every].any() else every
        out[mine] = np.column_stack([np.interp(at[mine], time[rows], v) for v in values[rows].T])
    return out
