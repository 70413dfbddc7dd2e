"""Circles that runs drove, row by row and in either direction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.stats import binned_statistic

from camcomp.ground.datatypes import Bools, Floats, Path

_NEAR_MM = 0.5  # of the circle: set-points that far off are on another path
_WIDEST_DEG = 15.0  # gap of a circle that counts as whole: between its rows, or of its program
OUTWARD = np.column_stack([of(np.radians(np.arange(360) + 0.5)) for of in (np.cos, np.sin)])  # (360, 2) at every degree


@dataclass(frozen=True, eq=False)
class Circle:
    """A nominal circle in the program frame: centre (3,), radius mm, the axes of the plane it lies in."""

    centre: Floats
    radius: float
    plane: tuple[int, int]

    @property
    def name(self) -> str:
        """Radius, plane and centre."""
        a, b = ("XYZ"[i] for i in self.plane)
        at = ", ".join(f"{value + 0.0:.4g}" for value in self.centre)
        return f"R {self.radius:.4g} mm in {a}{b} about ({at})"


@dataclass(frozen=True, eq=False)
class Turn:
    """A circle as one run drove it in one direction: which of its rows (n,), and the angles (n,) deg, 0 to 360, where its set-points lead."""

    circle: Circle
    counter_clockwise: bool
    rows: Bools
    angle: Floats

    @property
    def way(self) -> Literal["counter-clockwise", "clockwise"]:
        """The direction in words."""
        return "counter-clockwise" if self.counter_clockwise else "clockwise"

    def off(self, tip: Floats) -> Floats:
        """Measured radius minus the programmed one about the programmed centre, um at every degree (360,) where the tip (n, 3) mm was."""
        a, b = self.circle.plane
        out = tip[self.rows] - self.circle.centre
        at = np.degrees(np.arctan2(out[:, b], out[:, a])) % 360.0
        return _every_degree(at, 1e3 * (np.hypot(out[:, a], out[:, b]) - self.circle.radius))

    def radial(self, vectors: Floats) -> Floats:
        """The part of vectors (n, 3) along the radius, outwards, at every degree (360,)."""
        at = self.angle[self.rows]
        outward = np.column_stack((np.cos(np.radians(at)), np.sin(np.radians(at))))
        return _every_degree(at, np.sum(vectors[self.rows][:, list(self.circle.plane)] * outward, axis=1))


def turns_of(program: Path, commanded: Floats, measured: Floats) -> list[Turn]:
    """Every circle that a run drove whole, in either direction.

    commanded (n, 3) mm: tips where the set-points lead, program frame; measured (n, k): rows that are not finite do not count.
    """
    known = np.asarray(np.isfinite(measured).all(axis=1))
    found = (_turn(circle, way, commanded, known) for circle in _circles(program) for way in (True, False))
    return [turn for turn in found if turn is not None]


def points(circle: Circle, off: Floats) -> Floats:
    """Points (360, 2) mm from the centre of a circle whose radius is off by (360,) um."""
    return np.asarray((circle.radius + 1e-3 * off)[:, None] * OUTWARD)


def _circles(path: Path) -> list[Circle]:
    """The circles on which a program turns at least once, whole, on one level; arcs in pieces count together."""
    angle: dict[str, float] = {}
    found: dict[str, Circle] = {}
    for k in np.flatnonzero(np.isfinite(path.centre[:, 0]) & path.known & ~path.machine):
        if np.count_nonzero(path.axis[k]) != 1:
            continue  # aslant
        a, b = (i for i in range(3) if not path.axis[k, i])
        level = 3 - a - b
        if abs(path.end[k, level] - path.start[k, level]) > 1e-6:
            continue
        circle = Circle(path.centre[k], float(np.linalg.norm(path.start[k] - path.centre[k])), (a, b))
        found.setdefault(circle.name, circle)
        angle[circle.name] = angle.get(circle.name, 0.0) + abs(float(path.angle[k]))
    return [circle for name, circle in found.items() if angle[name] > np.radians(360.0 - _WIDEST_DEG)]


def _turn(circle: Circle, counter_clockwise: bool, commanded: Floats, known: Bools) -> Turn | None:
    """The rows on a circle in one direction; None where they do not cover a whole turn."""
    a, b = circle.plane
    told = commanded - circle.centre
    angle = np.arctan2(told[:, b], told[:, a])
    near = np.abs(np.hypot(told[:, a], told[:, b]) - circle.radius) < _NEAR_MM
    near &= np.abs(told[:, 3 - a - b]) < _NEAR_MM
    step = np.gradient(np.unwrap(np.where(np.isfinite(angle), angle, 0.0)))
    near &= (step > 0.0) if counter_clockwise else (step < 0.0)
    near &= known & np.isfinite(angle)
    at = np.degrees(angle) % 360.0
    seen = np.sort(at[near])
    if not len(seen) or np.diff(seen, append=seen[0] + 360.0).max() > _WIDEST_DEG:
        return None
    return Turn(circle, counter_clockwise, near, at)


def _every_degree(at: Floats, values: Floats) -> Floats:
    """Values (n,) at angles (n,) deg as means over sectors of two rows or a degree, whichever is wider, at (360,) degrees."""
    sectors = int(np.clip(len(at) // 2, 24, 360))
    centre, mean = binned_statistic(at, [at, values], bins=sectors, range=(0.0, 360.0)).statistic
    seen = np.isfinite(mean)
    return np.asarray(np.interp(np.arange(360) + 0.5, centre[seen], mean[seen], period=360.0))
