"""The path frame: e_t along the feed, e_z the tool axis away from the workpiece, e_r = e_t x e_z, right of the feed.

On a ramp e_t is the part of the feed direction across the tool axis (the horizontal part of an upright tool's feed), so
that the frame stays square to the tool. On a plunge there is no such part; e_t is then by convention the frame's own x
(or y) axis, projected across the tool, so that conversion to components and back preserves a measured vector.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of the compiled function.

import math

import numpy as np
from numpy.typing import ArrayLike

from camcomp.ground.compiled import entry
from camcomp.ground.datatypes import Floats
from camcomp.ground.vectors import cross_with, sizes
from camcomp.model.statics.vectors import cross, dot, part, plus

ALONG_SINE = 1e-6  # of the angle between feed and tool axis; below it the feed has no direction across the tool


def lateral(tangent: ArrayLike, tool_axis: ArrayLike) -> Floats:
    """Sine (n,) of the angle between the feed direction (n, 3) and the tool axis (3,); 1 for a level feed."""
    return sizes(np.asarray(tangent, float) @ cross_with(np.asarray(tool_axis, float)))


def path_frame(tangent: ArrayLike, tool_axis: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Unit vectors e_r, e_t, e_z, each (n, 3), for unit feed directions (n, 3) and a unit tool axis (3,)."""
    axis = np.asarray(tool_axis, float)
    across = _across(np.asarray(tangent, float), axis)
    length = sizes(across)
    plunge = length <= ALONG_SINE
    e_t = across / np.where(plunge, 1.0, length)[:, None]
    e_t[plunge] = _substitute(axis)
    return e_t @ cross_with(axis), e_t, np.broadcast_to(axis, e_t.shape)


def to_vector(components: ArrayLike, tangent: ArrayLike, tool_axis: ArrayLike) -> Floats:
    """Vectors (n, 3) in the frame of the tangent from components (Fr, Ft, Fz) (n, 3), same unit."""
    parts, along = np.asarray(components, float), np.asarray(tangent, float)
    axis, out = np.asarray(tool_axis, float), np.empty((len(along), 3))
    put_vectors(parts, along, axis, _substitute(axis), out)
    return out


@entry
def put_vectors(components, tangent, axis, other, out):
    """Fills out (n, 3) with Fr e_r + Ft e_t + Fz e_z; other (3,): e_t of plunges."""
    z = part(axis, 0)
    for i in range(out.shape[0]):
        t = part(tangent[i], 0)
        t = plus(t, z, -dot(t, z))
        size = math.sqrt(dot(t, t))
        if size > ALONG_SINE:
            t = (t[0] / size, t[1] / size, t[2] / size)
        else:
            t = part(other, 0)
        r = cross(t, z)
        for k in range(3):
            out[i, k] = components[i, 0] * r[k] + components[i, 1] * t[k] + components[i, 2] * z[k]


def to_components(vectors: ArrayLike, tangent: ArrayLike, tool_axis: ArrayLike) -> Floats:
    """Components (Fr, Ft, Fz) (n, 3) of vectors (n, 3); the inverse of to_vector."""
    frame = np.stack(path_frame(tangent, tool_axis), axis=1)
    out: Floats = np.einsum("nij,nj->ni", frame, np.asarray(vectors, float))
    return out


def _across(tangent: Floats, axis: Floats) -> Floats:
    return tangent - (tangent @ axis)[:, None] * axis


def _substitute(axis: Floats) -> Floats:
    base = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    across = base - (base @ axis) * axis
    return across / np.linalg.norm(across)
