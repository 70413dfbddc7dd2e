"""Finite rotations for the truth plants, over any leading batch shape (radians).

Rotation vectors are turned into matrices by Rodrigues' formula and back by the half-angle quaternion, so that
small and large angles are equally exact.  Nothing here is shared with the package under test.
"""

from __future__ import annotations

import numpy as np


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products (..., 3) of a and b (..., 3), without what numpy's does for vectors of other lengths."""
    (ax, ay, az), (bx, by, bz) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], -1)


def hat(w: np.ndarray) -> np.ndarray:
    """Cross-product matrices (..., 3, 3) of the vectors w (..., 3)."""
    out = np.zeros((*w.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2] = -w[..., 2], w[..., 1]
    out[..., 1, 0], out[..., 1, 2] = w[..., 2], -w[..., 0]
    out[..., 2, 0], out[..., 2, 1] = -w[..., 1], w[..., 0]
    return out


# sin(a)/a, (1 - cos a)/a² and (a - sin a)/a³ without cancellation at small angles a
def _first(a: np.ndarray, small: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.where(small, 1 - q / 6 * (1 - q / 20 * (1 - q / 42)), np.sin(a) / a)


def _second(a: np.ndarray, small: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.where(small, 0.5 * (1 - q / 12 * (1 - q / 30)), 2 * (np.sin(a / 2) / a) ** 2)


def _third(a: np.ndarray, small: np.ndarray, q: np.ndarray) -> np.ndarray:
    return np.where(small, 1 / 6 * (1 - q / 20 * (1 - q / 42)), (a - np.sin(a)) / a**3)


def _angle(w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles a (...) of w, 1 where they are small; which are; their squares."""
    q = (w * w).sum(-1)
    angle = np.sqrt(q)
    small = angle < 1e-2
    return np.where(small, 1.0, angle), small, q


def turn(w: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of the rotation vectors w (..., 3)."""
    angle, h = _angle(w), hat(w)
    return np.eye(3) + _first(*angle)[..., None, None] * h + _second(*angle)[..., None, None] * (h @ h)


def rate(w: np.ndarray) -> np.ndarray:
    """Matrices (..., 3, 3) that take d(rotation vector) to the spatial angular displacement of turn(w)."""
    angle, h = _angle(w), hat(w)
    return np.eye(3) + _second(*angle)[..., None, None] * h + _third(*angle)[..., None, None] * (h @ h)


def vector(r: np.ndarray) -> np.ndarray:
    """Rotation vectors (..., 3) of the matrices r (..., 3, 3); angles below pi."""
    skew = 0.5 * np.stack([r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]], -1)
    sine = np.linalg.norm(skew, axis=-1)
    cosine = 0.5 * (np.trace(r, axis1=-2, axis2=-1) - 1)
    angle = np.arctan2(sine, cosine)
    scale = np.where(sine < 1e-9, 1.0, angle / np.where(sine < 1e-9, 1.0, sine))
    return scale[..., None] * skew


def about(axis: int, angle: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3) by angle (...) about the coordinate axis 0, 1 or 2."""
    w = np.zeros((*np.shape(angle), 3))
    w[..., axis] = angle
    return turn(w)


class Walk:
    """Walks along a chain and keeps its pose and the spatial twist of every coordinate.

    A twist is stored as (w, m): the end turns by w and the point at the origin moves by m per unit of the coordinate.
    """

    def __init__(self, batch: int, coordinates: int) -> None:
        """Start at the identity for `batch` chains that have `coordinates` moving coordinates."""
        self.r = np.broadcast_to(np.eye(3), (batch, 3, 3)).copy()
        self.t = np.zeros((batch, 3))
        self.w = np.zeros((batch, 3, coordinates))
        self.m = np.zeros((batch, 3, coordinates))

    def shift(self, v: np.ndarray) -> None:
        """Fixed translation v (3,) or (batch, 3), mm, in the current frame."""
        self.t = self.t + np.einsum("bij,bj->bi", self.r, np.broadcast_to(v, self.t.shape))

    def rotate(self, matrix: np.ndarray) -> None:
        """Fixed rotation."""
        self.r = self.r @ matrix

    def hinge(self, axis: int, angle: np.ndarray, coordinate: int, sign: float = 1.0) -> None:
        """Rotation by sign*angle about a coordinate axis; a coordinate may move several hinges."""
        w = sign * self.r[:, :, axis]
        self.w[:, :, coordinate] += w
        self.m[:, :, coordinate] += cross(self.t, w)
        self.r = self.r @ about(axis, sign * angle)

    def slide(self, axis: int, length: np.ndarray, coordinate: int) -> None:
        """Translation by a coordinate along a coordinate axis."""
        self.m[:, :, coordinate] += self.r[:, :, axis]
        self.t = self.t + self.r[:, :, axis] * np.asarray(length)[:, None]

    def spring(self, xi: np.ndarray, coordinates: list[int | None]) -> None:
        """6-dof spring deflection xi (batch, 6): translation, then rotation vector; None marks a locked entry."""
        for k in range(3):
            if coordinates[k] is not None:
                self.m[:, :, coordinates[k]] += self.r[:, :, k]
        self.t = self.t + np.einsum("bij,bj->bi", self.r, xi[:, :3])
        directions = self.r @ rate(xi[:, 3:])
        for k in range(3):
            if coordinates[3 + k] is not None:
                w = directions[:, :, k]
                self.w[:, :, coordinates[3 + k]] += w
                self.m[:, :, coordinates[3 + k]] += cross(self.t, w)
        self.r = self.r @ turn(xi[:, 3:])
