"""The path frame: e_t along the feed, e_z the tool axis away from the workpiece, e_r = e_t x e_z, right of the feed.

On a ramp e_t is the part of the feed direction across the tool axis (the horizontal part of an upright tool's feed), so
that the frame stays square to the tool. On a plunge there is no such part; e_t is then by convention the frame's own x
(or y) axis, projected across the tool, so that conversion to components and back preserves a measured vector.
"""

import numpy as np
from numpy.typing import ArrayLike

from camcomp.ground.datatypes import Floats

ALONG_SINE = 1e-6  # of the angle between feed and tool axis; below it the feed has no direction across the tool


def lateral(tangent: ArrayLike, tool_axis: ArrayLike) -> Floats:
    """Sine (n,) of the angle between the feed direction (n, 3) and the tool axis (3,); 1 for a level feed."""
    across = _across(np.asarray(tangent, float), np.asarray(tool_axis, float))
    out: Floats = np.linalg.norm(across, axis=-1)
    return out


def path_frame(tangent: ArrayLike, tool_axis: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Unit vectors e_r, e_t, e_z, each (n, 3), for unit feed directions (n, 3) and a unit tool axis (3,)."""
    axis = np.asarray(tool_axis, float)
    across = _across(np.asarray(tangent, float), axis)
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    plunge = length <= ALONG_SINE
    e_t = np.where(plunge, _substitute(axis), across / np.where(plunge, 1.0, length))
    e_z = np.broadcast_to(axis, e_t.shape).copy()
    return np.cross(e_t, e_z), e_t, e_z


def to_vector(components: ArrayLike, tangent: ArrayLike, tool_axis: ArrayLike) -> Floats:
    """Vectors (n, 3) in the frame of the tangent from components (Fr, Ft, Fz) (n, 3), same unit."""
    frame = np.stack(path_frame(tangent, tool_axis), axis=1)
    out: Floats = np.einsum("ni,nij->nj", np.asarray(components, float), frame)
    return out


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
