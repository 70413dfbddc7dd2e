"""Where a piece of path must be divided so that straight lines between commanded tips keep within the tolerance.

A chord of the commanded curve x(w) over a step h misses it by |x''| h^2 / 8. Inner points are moved out by half of
that, so that the miss is shared by both sides: |x''| h^2 / 16. Steps that spend the tolerance evenly, h ~ |x''|^-1/2,
are the fewest. The two end steps of a piece keep one end in place and are END_STEP as long as inner ones.
"""

from __future__ import annotations

import numpy as np

from camcomp.ground.datatypes import Floats, Ints
from camcomp.ground.records import dataclass
from camcomp.ground.vectors import sizes

END_STEP = 0.85  # largest miss of an end step = that of an inner one (0.062 against 0.0625 of |x''| h^2)
SHARE = 16.0  # inner step: miss = |x''| h^2 / SHARE
SINGLE = 8.0  # a piece in one step: both ends in place
COARSE_MM = 8.0  # distance of trial points on straight lines without effects


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


def trial_nodes(length: Floats, angle: Floats, divide: np.ndarray, spacing: float = COARSE_MM) -> Nodes:
    """At least three nodes where `divide`, one every `spacing` mm of length (p,) and 15 degrees of arc (p,); two elsewhere."""
    along = np.ceil(length / spacing) * (length > 0.25 * spacing)
    count = np.where(divide, 3 + along + np.ceil(np.abs(angle) / 0.26), 2)
    return _spread(count.astype(np.int64))


def _spread(count: Ints) -> Nodes:
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
    out = _spread(count + 1)
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
