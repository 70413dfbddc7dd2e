"""Arcs through three points."""

import math

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.path_geometry import turn

_FLAT = 1e-9  # of the sine between two chords


def arc_through(
    start: Floats, middle: Floats, end: Floats, sweep_deg: float | None = None
) -> tuple[Floats, Floats, float, Floats] | None:
    """Centre (3,), axis (3,), angle rad about it and end (3,) of the arc from start through middle to end.

    sweep_deg: it goes on to this angle, negative against the direction of the points. The axis is the one whose largest
    component is positive. None where the points lie on one line.
    """
    a, b = middle - start, end - start
    normal = np.cross(a, b)
    size = float(np.linalg.norm(normal))
    if size <= _FLAT * float(np.linalg.norm(a) * np.linalg.norm(b)) or size == 0.0:
        return None
    to_centre = np.cross(np.dot(a, a) * b - np.dot(b, b) * a, normal)
    centre = start + to_centre / (2.0 * size**2)
    axis = normal / size
    axis[np.abs(axis) < 1e-12] = 0.0
    u, v = start - centre, end - centre
    angle = math.atan2(float(axis @ np.cross(u, v)), float(u @ v)) % math.tau
    if sweep_deg is not None:
        angle = math.radians(sweep_deg)
        end = centre + turn(u[None], axis[None], np.array([angle]))[0]
    if axis[int(np.argmax(np.abs(axis)))] < 0.0:
        axis, angle = -axis + 0.0, -angle
    return centre, axis, angle, end
