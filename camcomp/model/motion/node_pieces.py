"""Smooth fields along a path: every motion is cut into pieces, each with a few nodes; values between are polynomials.

The nodes of a piece are Chebyshev points of the second kind, its ends included; barycentric interpolation (Berrut and
Trefethen, SIAM Review 46, 2004). Six nodes on 60 degrees of an arc, or on 60 mm of a line, give the deflection of the
Orthoglide within 0.01 um.
"""

import numpy as np

from camcomp.ground.datatypes import ARC, Floats, Ints, Path
from camcomp.ground.records import dataclass

NODES = 6
_ARC_RAD = np.pi / 3
_LINE_MM = 60.0
SPLIT = 0.5 * (1.0 - np.cos(np.pi * np.arange(NODES) / (NODES - 1)))  # on 0 .. 1
_WEIGHT = np.array([0.5 if j in (0, NODES - 1) else 1.0 for j in range(NODES)]) * (-1.0) ** np.arange(NODES)


@dataclass(frozen=True, eq=False)
class Pieces:
    """p pieces in order. motion (p,): counted among the feed motions; u0, u1 (p,): part of the motion."""

    motion: Ints
    u0: Floats
    u1: Floats

    def nodes(self) -> tuple[Ints, Floats]:
        """Piece (q,) and fraction of the piece (q,) of every node; q = NODES x pieces."""
        return np.repeat(np.arange(len(self.motion)), NODES), np.tile(SPLIT, len(self.motion))

    def share(self, piece: Ints, w: Floats) -> Floats:
        """Share (n,) of the motion at fraction w (n,) of the piece."""
        return self.u0[piece] + w * (self.u1[piece] - self.u0[piece])

    def at(self, motion: Ints, share: Floats) -> "Places":
        """Interpolation at points (n,) given by motion and share of its length."""
        share = np.clip(share, 0.0, 1.0)
        # A share of 1 is the end of its own motion, not the start of the next.
        key = motion + np.minimum(share, 1.0 - 1e-12)
        piece = np.clip(np.searchsorted(self.motion + self.u0, key, side="right") - 1, 0, len(self.motion) - 1)
        local = np.clip((share - self.u0[piece]) / (self.u1[piece] - self.u0[piece]), 0.0, 1.0)
        return Places(piece, piece[:, None] * NODES + np.arange(NODES), basis_at(local))


def basis_at(local: Floats) -> Floats:
    """Weights (n, NODES) of a piece's nodes at fractions local (n,) of the piece."""
    gap = local[:, None] - SPLIT[None, :]
    hit = np.abs(gap) < 1e-14
    raw = _WEIGHT / np.where(hit, 1.0, gap)
    basis = raw / raw.sum(axis=1, keepdims=True)
    on_node = hit.any(axis=1)
    basis[on_node] = hit[on_node]
    return np.asarray(basis, float)


@dataclass(frozen=True, eq=False)
class Places:
    """Points between nodes: piece (n,), node (n, NODES) and their weights (n, NODES)."""

    piece: Ints
    node: Ints
    basis: Floats

    def of(self, values: Floats) -> Floats:
        """Node values (q, ...) interpolated to the points (n, ...)."""
        flat = values.reshape(len(values), -1)
        out = np.einsum("nj,njc->nc", self.basis, flat[self.node])
        found: Floats = out.reshape(len(self.piece), *values.shape[1:])
        return found


def cut(path: Path, motion: Ints, u0: Floats, u1: Floats, length: Floats) -> tuple[Ints, Floats, Floats]:
    """Split motions (k,) of `length` (k,) mm into pieces of at most _LINE_MM or _ARC_RAD: part (p,), u0 (p,) and u1 (p,)."""
    arc = path.kind[motion] == ARC
    wanted = np.where(arc, np.abs(path.angle[motion]) * (u1 - u0) / _ARC_RAD, length / _LINE_MM)
    count = np.maximum(np.ceil(wanted - 1e-9), 1).astype(np.int64)
    part = np.repeat(np.arange(len(motion)), count)
    within = np.arange(len(part)) - (np.cumsum(count) - count)[part]
    step = (u1 - u0)[part] / count[part]
    return part, u0[part] + within * step, u0[part] + (within + 1) * step


def direct(n: int) -> Places:
    """Every point is its own node and its own piece: for poses that no path connects."""
    each = np.arange(n)
    return Places(each, each[:, None], np.ones((n, 1)))
