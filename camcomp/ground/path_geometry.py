"""Points, directions and lengths along the motions of a Path, for arrays of (motion, u), u in [0, 1] of the motion.

Arcs turn uniformly with u; where the end lies on another radius than the start the radius changes linearly (as controls
do within their radius tolerance), and a helix climbs linearly.
"""

import numpy as np

from camcomp.ground.datatypes import ARC, Floats, Ints, Path


def turn(vectors: Floats, axis: Floats, angle: Floats) -> Floats:
    """Vectors (k, 3) rotated about unit axes (k, 3) by angles (k,) rad."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    along = np.sum(vectors * axis, axis=1, keepdims=True) * axis
    out: Floats = along + (vectors - along) * c + np.cross(axis, vectors) * s
    return out


def _arc(path: Path, motion: Ints) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Radius vector at the start, climb along the axis, end/start radius - 1, axis, angle, per row."""
    axis, angle = path.axis[motion], path.angle[motion]
    first = path.start[motion] - path.centre[motion]
    last = path.end[motion] - path.centre[motion]
    climb = np.sum(last * axis, axis=1)
    last = last - climb[:, None] * axis
    first = first - np.sum(first * axis, axis=1)[:, None] * axis
    radius = np.maximum(np.linalg.norm(first, axis=1), 1e-300)
    return first, climb, np.linalg.norm(last, axis=1) / radius - 1.0, axis, angle


def points(path: Path, motion: Ints, u: Floats) -> Floats:
    """Programmed tip (k, 3) mm at fraction u (k,) of motion (k,). Ends are exactly the programmed ones."""
    start, end = path.start[motion], path.end[motion]
    out: Floats = start + u[:, None] * (end - start)
    arc = path.kind[motion] == ARC
    if arc.any():
        which, at = motion[arc], u[arc]
        first, climb, growth, axis, angle = _arc(path, which)
        out[arc] = (
            path.centre[which]
            + turn(first, axis, at * angle) * (1.0 + growth * at)[:, None]
            + (climb * at)[:, None] * axis
        )
    last, first = u == 1.0, u == 0.0
    out[last], out[first] = end[last], start[first]
    return out


def tangents(path: Path, motion: Ints, u: Floats) -> Floats:
    """Unit direction of travel (k, 3); zero where the motion has no length."""
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
    found: Floats = np.divide(out, size, out=np.zeros_like(out), where=size > 0.0)
    return found


def lengths(path: Path) -> Floats:
    """Length (n,) mm of every motion (of a spiral to second order in its change of radius)."""
    out = np.linalg.norm(path.end - path.start, axis=1)
    arc = np.flatnonzero(path.kind == ARC)
    if len(arc):
        first, climb, growth, _, angle = _arc(path, arc)
        radius = np.linalg.norm(first, axis=1)
        around = radius * (1.0 + 0.5 * growth) * np.abs(angle)
        out[arc] = np.sqrt(around**2 + climb**2 + (radius * growth) ** 2)
    found: Floats = out
    return found
