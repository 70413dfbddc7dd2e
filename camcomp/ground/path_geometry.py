"""Points, directions and lengths along the motions of a Path, or other Curves, for arrays of (motion, u), u in [0, 1] of the motion.

Arcs turn uniformly with u; where the end lies on another radius than the start the radius changes linearly (as controls
do within their radius tolerance), and a helix climbs linearly.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of the compiled functions.

import math

import numpy as np

from camcomp.ground.compiled import entry
from camcomp.ground.datatypes import ARC, Curves, Floats, Ints
from camcomp.ground.vectors import sizes


@entry
def between_ends(start, end, motion, u, out):
    """Fills out (k, 3) with points of lines (n, 3) at fractions u (k,) of lines (k,); at 0 and 1 exactly their ends."""
    for i in range(motion.shape[0]):
        k, w = motion[i], u[i]
        for j in range(3):
            a, b = start[k, j], end[k, j]
            out[i, j] = a if w == 0.0 else b if w == 1.0 else a + w * (b - a)


@entry
def directions(start, end, motion, out):
    """Fills out (k, 3) with the unit directions of lines (k,) from start to end (n, 3); zero for lines without length."""
    for i in range(motion.shape[0]):
        k = motion[i]
        x, y, z = end[k, 0] - start[k, 0], end[k, 1] - start[k, 1], end[k, 2] - start[k, 2]
        size = math.sqrt(x * x + y * y + z * z)
        if size > 0.0:
            out[i, 0], out[i, 1], out[i, 2] = x / size, y / size, z / size
        else:
            out[i, 0] = out[i, 1] = out[i, 2] = 0.0


def turn(vectors: Floats, axis: Floats, angle: Floats) -> Floats:
    """Vectors (k, 3) rotated about unit axes (k, 3) by angles (k,) rad."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    along = np.sum(vectors * axis, axis=1, keepdims=True) * axis
    out: Floats = along + (vectors - along) * c + np.cross(axis, vectors) * s
    return out


def _arc(path: Curves, motion: Ints) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Radius vector at the start, climb along the axis, end/start radius - 1, axis, angle, per row."""
    axis, angle = path.axis[motion], path.angle[motion]
    first = path.start[motion] - path.centre[motion]
    last = path.end[motion] - path.centre[motion]
    climb = np.sum(last * axis, axis=1)
    last = last - climb[:, None] * axis
    first = first - np.sum(first * axis, axis=1)[:, None] * axis
    radius = np.maximum(sizes(first), 1e-300)
    return first, climb, sizes(last) / radius - 1.0, axis, angle


def points(path: Curves, motion: Ints, u: Floats) -> Floats:
    """Programmed tip (k, 3) mm at fraction u (k,) of motion (k,). Ends are exactly the programmed ones."""
    out = np.empty((len(motion), 3))
    between_ends(path.start, path.end, motion, u, out)
    arc = path.kind[motion] == ARC if (path.kind == ARC).any() else None
    if arc is not None and arc.any():
        which, at = motion[arc], u[arc]
        first, climb, growth, axis, angle = _arc(path, which)
        out[arc] = (
            path.centre[which]
            + turn(first, axis, at * angle) * (1.0 + growth * at)[:, None]
            + (climb * at)[:, None] * axis
        )
        last, first = u == 1.0, u == 0.0
        out[last], out[first] = path.end[motion[last]], path.start[motion[first]]
    return out


def tangents(path: Curves, motion: Ints, u: Floats) -> Floats:
    """Unit direction of travel (k, 3); zero where the motion has no length."""
    if not (path.kind == ARC).any():
        found = np.empty((len(motion), 3))
        directions(path.start, path.end, motion, found)
        return found
    out = path.end[motion] - path.start[motion]
    arc = path.kind[motion] == ARC
    if arc.any():
        which, at = motion[arc], u[arc]
        first, climb, growth, axis, angle = _arc(path, which)
        radial = turn(first, axis, at * angle)
        out[arc] = (
            np.cross(axis, radial) * (angle * (1.0 + growth * at))[:, None]
            + radial * growth[:, None]
            + climb[:, None] * axis
        )
    size = np.linalg.norm(out, axis=1, keepdims=True)
    return np.asarray(np.divide(out, size, out=np.zeros_like(out), where=size > 0.0))


def lengths(path: Curves) -> Floats:
    """Length (n,) mm of every motion (of a spiral to second order in its change of radius)."""
    out = sizes(path.end - path.start)
    arc = np.flatnonzero(path.kind == ARC)
    if len(arc):
        first, climb, growth, _, angle = _arc(path, arc)
        radius = sizes(first)
        around = radius * (1.0 + 0.5 * growth) * np.abs(angle)
        out[arc] = np.sqrt(around**2 + climb**2 + (radius * growth) ** 2)
    found: Floats = out
    return found
