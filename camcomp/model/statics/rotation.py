"""Rotation vectors and rotation matrices outside the compiled solver."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def cross_matrix(v: ArrayLike) -> Array:
    """(3, 3) matrix [v] with [v] u = v x u."""
    x, y, z = (float(a) for a in np.asarray(v, float))
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def exp_rotation(w: ArrayLike) -> Array:
    """Rotation matrix (3, 3) of the rotation vector w (3,) rad (Rodrigues' formula)."""
    x = cross_matrix(w)
    angle = math.sqrt(0.5 * float(np.sum(x * x)))
    if angle < 1e-4:  # the closed forms lose digits; the next terms are below 1e-17
        a, b = 1.0 - angle * angle / 6.0, 0.5 - angle * angle / 24.0
    else:
        a, b = math.sin(angle) / angle, 2.0 * (math.sin(0.5 * angle) / angle) ** 2
    return np.eye(3) + a * x + b * (x @ x)


def rotation_vectors(R: ArrayLike) -> Array:
    """Rotation vectors (..., 3) rad of rotation matrices (..., 3, 3); angles up to just below pi."""
    R = np.asarray(R, float)
    w = 0.5 * np.stack((R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]), axis=-1)
    s = np.linalg.norm(w, axis=-1)
    angle = np.arctan2(s, 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1.0))
    return w * np.where(s > 1e-12, angle / np.maximum(s, 1e-300), 1.0)[..., None]


def _cross_matrices(w: Array) -> Array:
    out = np.zeros((len(w), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -w[:, 2], w[:, 1], -w[:, 0]
    return out - out.transpose(0, 2, 1)


def rotations_of(w: Array) -> Array:
    """Rotations (n, 3, 3) of rotation vectors (n, 3)."""
    angle = np.linalg.norm(w, axis=1)[:, None, None]
    W = _cross_matrices(w)
    small = angle < 1e-8
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 1.0, np.sin(safe) / safe)
    b = np.where(small, 0.5, (1.0 - np.cos(safe)) / safe**2)
    return np.eye(3) + a * W + b * (W @ W)
