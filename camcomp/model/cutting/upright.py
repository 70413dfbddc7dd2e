"""Arcs in planes along the tool axis (G18, G19): positions at which the direction across the tool reverses.

The tangent of such an arc is parallel to the tool twice a turn. There the direction across the tool reverses, and the side
force with it: at once if the arc stays in its plane, over a short distance if it also moves out of it. Rounded end points
make the arc a spiral, whose tangent is vertical at a slightly different angle; the positions are those of the spiral.
"""

from __future__ import annotations

import numpy as np

from camcomp.ground.datatypes import ARC, Floats, Ints, Path
from camcomp.ground.records import dataclass

REVERSAL_OFFSET_RAD = 2e-4  # rad from a sharp reversal at which the directions on its sides are taken
AT_END = 1e-5  # rad from the ends of an arc at which its directions there are taken; undefined at the vertical itself
NEAR_END = 1e-3  # rad: a reversal so near to an end of an arc, whose end points are rounded, is at that end
SHARP = 3e-4  # sine of the angle to the tool axis below which the direction reverses at once
LEVEL = 1e-7  # sine of the slope of an arc that stays in its plane
SPREAD, WIDE = 3.0, 0.3  # a gradual reversal is divided at its width times powers of SPREAD, up to WIDE rad
SIDES = 3.0  # times the width of a reversal: distance at which the directions on its sides are taken
ROUNDS = 6


@dataclass(frozen=True, eq=False)
class Verticals:
    """Positions (k,) where arcs are nearest to the direction of the tool: motion, fraction u, sine of the angle between them.

    Those of a motion are ascending in u.
    """

    motion: Ints
    u: Floats
    sine: Floats

    @classmethod
    def none(cls) -> Verticals:
        """An empty list of positions."""
        return cls(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))

    @classmethod
    def of(cls, path: Path, tool_axis: Floats) -> Verticals:
        """All positions of a path."""
        if not (path.kind == ARC).any():
            return cls.none()
        tool = np.asarray(tool_axis, float)
        arcs = np.flatnonzero((path.kind == ARC) & (np.abs(path.axis @ tool) < 1e-3) & path.known & ~path.machine)
        axis, angle = path.axis[arcs], path.angle[arcs]
        side = np.cross(axis, tool)
        first, last = path.start[arcs] - path.centre[arcs], path.end[arcs] - path.centre[arcs]
        climb = np.sum((last - first) * axis, axis=1)
        radius, final = (np.hypot(each @ tool, np.sum(each * side, axis=1)) for each in (first, last))
        growth = final / np.maximum(radius, 1e-300) - 1.0
        begin = np.arctan2(np.sum(first * side, axis=1), first @ tool)
        low, high = np.minimum(begin, begin + angle), np.maximum(begin, begin + angle)
        count = np.floor(high / np.pi - 0.5) - np.ceil(low / np.pi - 0.5) + 3.0  # one more on either side
        of = np.repeat(np.arange(len(arcs)), count.astype(np.int64))
        k = np.arange(len(of)) - np.searchsorted(of, of) + np.ceil(low / np.pi - 0.5)[of] - 1.0
        u = np.zeros(len(of))
        for _ in range(ROUNDS):  # the radius grows with u, by little
            leans = np.arctan2(growth[of], angle[of] * (1.0 + growth[of] * u) * np.sign(angle[of])) * np.sign(angle[of])
            u = ((k + 0.5) * np.pi + leans - begin[of]) / angle[of]
        inside = (u >= -NEAR_END / np.abs(angle[of])) & (u <= 1.0 + NEAR_END / np.abs(angle[of]))
        of, u = of[inside], u[inside]
        way = np.hypot(radius[of] * angle[of] * (1.0 + growth[of] * u), radius[of] * growth[of])
        sine = np.abs(climb[of]) / np.maximum(np.hypot(way, climb[of]), 1e-300)
        order = np.lexsort((u, of))
        return cls(arcs[of[order]], u[order], sine[order])

    @property
    def sides(self) -> Floats:
        """Angles (k,) rad from the reversals at which the directions on their sides are taken."""
        return np.maximum(REVERSAL_OFFSET_RAD, SIDES * self.sine)

    def overturns(self, path: Path) -> list[tuple[int, float]]:
        """Motions and fractions, away from their ends, at which the direction reverses at once."""
        end = NEAR_END / np.abs(path.angle[self.motion])
        sharp = (self.sine < SHARP) & (self.u > end) & (self.u < 1.0 - end)
        return [(int(i), float(u)) for i, u in zip(self.motion[sharp], self.u[sharp], strict=True)]

    def swings(self, path: Path) -> tuple[Ints, Floats]:
        """Motions and fractions at which arcs are divided around gradual reversals of their direction."""
        slow = np.flatnonzero(self.sine > LEVEL)
        powers = SPREAD ** np.arange(np.ceil(np.log(WIDE / REVERSAL_OFFSET_RAD) / np.log(SPREAD)))
        width = np.where(self.sine < SHARP, self.sides, self.sine)[slow, None] * powers
        off = np.concatenate((-width[:, ::-1], width), axis=1) / np.abs(path.angle[self.motion[slow]])[:, None]
        wanted = np.concatenate((width[:, ::-1], width), axis=1) <= WIDE
        motion, u = np.repeat(self.motion[slow], off.shape[1])[wanted.ravel()], (self.u[slow, None] + off)[wanted]
        inside = (u > 1e-6) & (u < 1.0 - 1e-6)
        return motion[inside], u[inside]

    def beside(self, path: Path, tool_axis: Floats, motion: Ints, u0: Floats, u1: Floats) -> tuple[Floats, Floats]:
        """Fractions of the motion near both ends of parts (p,) at which the directions of the ends are taken."""
        if not (path.kind == ARC).any():
            return np.zeros(len(motion)), np.zeros(len(motion))
        upright = (path.kind[motion] == ARC) & (np.abs(path.axis[motion] @ np.asarray(tool_axis, float)) < 0.999)
        angle = np.where(upright, np.maximum(np.abs(path.angle[motion]), 4.0 * AT_END), 1.0)
        head = np.where(upright, AT_END / angle, 0.0)
        tail = head.copy()
        end = NEAR_END / angle
        sharp = self.sine < SHARP
        for i, u, sides in zip(self.motion[sharp], self.u[sharp], self.sides[sharp], strict=True):
            for p in np.flatnonzero(motion == i):
                side = sides / angle[p]
                if abs(u - u0[p]) <= end[p]:
                    head[p] = max(head[p], u - u0[p] + side)
                if abs(u - u1[p]) <= end[p]:
                    tail[p] = max(tail[p], u1[p] - u + side)
        most = 0.25 * (u1 - u0)
        return np.minimum(head, most), np.minimum(tail, most)
