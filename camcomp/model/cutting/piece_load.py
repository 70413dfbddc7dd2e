"""Load of the pieces of a path with a known stock: linear between the places of the engagement."""

from __future__ import annotations

import numpy as np

from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.records import dataclass
from camcomp.model.cutting.engaged import Engaged

STRAIGHT = 1e-9  # of the force: deviation from the line between its neighbours below which a place is redundant


@dataclass(frozen=True, eq=False)
class PieceLoad:
    """Pieces (p,): force of the model (p, 3) N as Fr, Ft, Fz at both ends, and whether the tool cuts."""

    base0: Floats
    base1: Floats
    on: Bools

    @classmethod
    def of(cls, engaged: Engaged, base: Floats, motion: Ints, u0: Floats, u1: Floats) -> PieceLoad:
        """Loads of parts u0 to u1 of motions (p,) from the forces (k, 3) at the places; every jump has a place."""
        left, right, known = engaged.around(motion, 0.5 * (u0 + u1))
        if not len(engaged.u):
            return cls(np.zeros((len(motion), 3)), np.zeros((len(motion), 3)), np.zeros(len(motion), np.bool_))
        span = np.where(known, engaged.u[right] - engaged.u[left], 1.0)
        ends = []
        for u in (u0, u1):
            w = np.clip((u - engaged.u[left]) / np.where(span > 0.0, span, 1.0), 0.0, 1.0)[:, None]
            ends.append(np.where(known[:, None], base[left] * (1.0 - w) + base[right] * w, 0.0))
        on = known & ((engaged.turn[left] > 0.0) | (engaged.turn[right] > 0.0))
        return cls(ends[0], ends[1], on)

    def base(self, piece: Ints, w: Floats) -> Floats:
        """Fr, Ft, Fz (k, 3) N at fractions w (k,) of pieces (k,)."""
        return self.base0[piece] * (1.0 - w)[:, None] + self.base1[piece] * w[:, None]

    def cut(self, of: Ints, begin: Floats, end: Floats) -> PieceLoad:
        """Loads of parts `begin` to `end` (q,) of pieces (q,)."""
        return PieceLoad(self.base(of, begin), self.base(of, end), self.on[of])


def needed(motion: Ints, u: Floats, turn: Floats, bends: Bools, base: Floats) -> Ints:
    """Places (q,) that linear interpolation of the force (k, 3) needs: starts and ends of cuts, and bends of the force.

    motion, u, turn, bends (k,): as in Engaged.
    """
    rows = np.flatnonzero(bends)
    return rows[_bent(motion[rows], u[rows], turn[rows] > 0.0, base[rows])]


def _bent(motion: Ints, u: Floats, on: Bools, base: Floats) -> Ints:
    n = len(u)
    if n < 3:
        return np.arange(n)
    before, after = slice(None, -2), slice(2, None)
    inner = (motion[before] == motion[after]) & (u[before] < u[1:-1]) & (u[1:-1] < u[after])
    span = np.where(inner, u[after] - u[before], 1.0)
    w = ((u[1:-1] - u[before]) / span)[:, None]
    off = np.abs(base[1:-1] - base[before] * (1.0 - w) - base[after] * w).max(axis=1)
    same = (on[before] == on[1:-1]) & (on[1:-1] == on[after])
    straight = inner & same & (off <= STRAIGHT * np.abs(base[1:-1]).max(axis=1))
    return np.flatnonzero(~np.concatenate(([False], straight, [False])))
