"""Orientation of the tool in programs, and its interpolation by controllers between two blocks.

rpy: words A, B, C in degrees, roll, pitch and yaw: R = Rz(C) Ry(B) Rx(A). Between blocks each word is linear in the path
length, as in LinuxCNC's genserkins and genhexkins. vector: words A3, B3, C3 of Sinumerik, the direction from the tip along
the tool; between blocks it moves on a great circle (ORIVECT), and R is the smallest rotation from +Z to it.
turn: the words of rpy; between two moves one rotation about a fixed axis, linear in the path length, as in robot languages.

R (3, 3) rotates the tool from the orientation that the machine holds without such words, in axes of the program frame.

Sources: LinuxCNC, posemath, pmRpyMatConvert; Siemens, Sinumerik 840D sl Job Planning, chapter Orientation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.records import Rows, dataclass

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

RPY, VECTOR, TURN = "rpy", "vector", "turn"
LETTERS = {RPY: ("A", "B", "C"), VECTOR: ("A3", "B3", "C3"), TURN: ("A", "B", "C")}
UPRIGHT = {RPY: (0.0, 0.0, 0.0), VECTOR: (0.0, 0.0, 1.0), TURN: (0.0, 0.0, 0.0)}
NEAR_POLE_DEG = 89.0  # of B: beyond it A and C rotate about nearly the same axis
_SAME_DIRECTION = 1e-12  # of the sine between two directions


@dataclass(frozen=True, eq=False)
class Orientation(Rows):
    """Words (n, 3) of n motions at their starts and ends; deg for rpy and turn, a unit vector for vector."""

    form: str
    start: Floats
    end: Floats

    def words(self, motion: Ints, u: Floats) -> Floats:
        """Words (k, 3) at fractions u (k,) of motions (k,)."""
        return between(self.form, self.start[motion], self.end[motion], u)

    def rotations(self, motion: Ints, u: Floats) -> Floats:
        """Rotations (k, 3, 3) at fractions u (k,) of motions (k,)."""
        return rotations_of(self.form, self.words(motion, u))


def between(form: str, start: Floats, end: Floats, u: Floats) -> Floats:
    """Words (k, 3) at fractions u (k,) between words (k, 3), as the controller interpolates them."""
    u = u[:, None]
    if form == RPY:
        return start + u * (end - start)
    if form == TURN:
        return _turned(start, end, u)
    angle = np.arctan2(np.linalg.norm(np.cross(start, end), axis=1), np.einsum("ni,ni->n", start, end))[:, None]
    sine = np.sin(angle)
    near = sine < _SAME_DIRECTION
    safe = np.where(near, 1.0, sine)
    arc = (np.sin((1.0 - u) * angle) * start + np.sin(u * angle) * end) / safe
    return _unit(np.where(near, start + u * (end - start), arc))


def _turned(start: Floats, end: Floats, u: Floats) -> Floats:
    """Words (k, 3) of rotations at fractions u (k, 1) of the turns from those of `start` to those of `end`."""
    out = start + u * (end - start)
    on = np.flatnonzero((np.abs(end - start) > 0.0).sum(axis=1) > 1)  # one word alone turns about one axis anyway
    if len(on):
        first = rotations_of(RPY, start[on])
        step = rotation_vectors(first.transpose(0, 2, 1) @ rotations_of(RPY, end[on])) * u[on]
        out[on] = words_of(RPY, first @ rotations_about(step), out[on])
    return out


def rotation_vectors(rotation: Floats) -> Floats:
    """Vectors (k, 3) rad of rotations (k, 3, 3) of less than half a turn."""
    R = rotation
    w = 0.5 * np.stack((R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]), axis=1)
    s = np.linalg.norm(w, axis=1)
    angle = np.arctan2(s, 0.5 * (np.trace(R, axis1=1, axis2=2) - 1.0))
    out: Floats = w * np.divide(angle, s, out=np.ones_like(s), where=s > _SAME_DIRECTION)[:, None]
    return out


def rotations_about(vectors: Floats) -> Floats:
    """Rotations (k, 3, 3) by vectors (k, 3) rad; formula of Rodrigues."""
    angle = np.linalg.norm(vectors, axis=1)
    x, y, z = (vectors / np.maximum(angle, 1e-300)[:, None]).T
    zero = np.zeros_like(x)
    K = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), 2, 0)
    out: Floats = np.eye(3) + np.sin(angle)[:, None, None] * K + (1.0 - np.cos(angle))[:, None, None] * (K @ K)
    return out


def rotations_of(form: str, words: Floats) -> Floats:
    """Rotations (k, 3, 3) of words (k, 3)."""
    if form == VECTOR:
        return smallest_rotations(_unit(words))
    (a, b, c), one = np.radians(words.T), np.ones(len(words))
    ca, sa, cb, sb, cc, sc = np.cos(a), np.sin(a), np.cos(b), np.sin(b), np.cos(c), np.sin(c)
    rows = [
        [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
        [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
        [-sb * one, cb * sa, cb * ca],
    ]
    out: Floats = np.moveaxis(np.array(rows), 2, 0)
    return out


def words_of(form: str, rotation: Floats, near: Floats) -> Floats:
    """Words (k, 3) of rotations (k, 3, 3); among angles that differ by full turns those nearest to `near` (k, 3)."""
    if form == VECTOR:
        direction: Floats = rotation[:, :, 2].copy()
        return direction
    one = pole_free_words(rotation)
    other = one * [1.0, -1.0, 1.0] + 180.0  # the same orientation over the other side of the pole
    one, other = (each + 360.0 * np.round((near - each) / 360.0) for each in (one, other))
    closer = np.linalg.norm(other - near, axis=1) < np.linalg.norm(one - near, axis=1)
    out: Floats = np.where(closer[:, None], other, one)
    return out


def pole_free_words(rotation: Floats) -> Floats:
    """Words A, B, C (k, 3) deg of rotations (k, 3, 3), with B between -90 and 90."""
    b = np.arctan2(-rotation[:, 2, 0], np.hypot(rotation[:, 2, 1], rotation[:, 2, 2]))
    a = np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
    c = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])
    out: Floats = np.degrees(np.stack((a, b, c), axis=1))
    return out


def angles_of(form: str, words: Floats) -> Floats:
    """Words (k, 3) of either form as A, B, C in degrees."""
    return words if form != VECTOR else words_of(RPY, rotations_of(form, words), np.zeros_like(words))


def _unit(vectors: Floats) -> Floats:
    out: Floats = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
    return out


def smallest_rotations(direction: Floats) -> Floats:
    """The smallest rotations (k, 3, 3) that bring +Z to directions (k, 3); about X where that is -Z."""
    x, y, z = direction.T
    down = z < -1.0 + 1e-12
    f = 1.0 / np.where(down, 1.0, 1.0 + z)
    out: Floats = np.moveaxis(
        np.array([[1.0 - x * x * f, -x * y * f, x], [-x * y * f, 1.0 - y * y * f, y], [-x, -y, z]]), 2, 0
    )
    out[down] = np.diag([1.0, -1.0, -1.0])
    return out


def rotations_of_quaternions(quaternions: Floats) -> Floats:
    """Rotations (k, 3, 3) of quaternions (k, 4), the real part first; their size is put right."""
    w, x, y, z = _unit(quaternions).T
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    out: Floats = np.moveaxis(np.array(rows), 2, 0)
    return out


def quaternions_of(rotation: Floats) -> Floats:
    """Unit quaternions (k, 4) of rotations (k, 3, 3), the real part first, by the largest of its parts."""
    R = rotation
    t = np.trace(R, axis1=1, axis2=2)
    d = np.stack((t, R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]), axis=1)
    squared = 1.0 + np.column_stack((t, 2.0 * d[:, 1:] - t[:, None]))  # 4 q_i^2
    s = {(0, 1): R[:, 2, 1] - R[:, 1, 2], (0, 2): R[:, 0, 2] - R[:, 2, 0], (0, 3): R[:, 1, 0] - R[:, 0, 1],
         (1, 2): R[:, 1, 0] + R[:, 0, 1], (1, 3): R[:, 0, 2] + R[:, 2, 0], (2, 3): R[:, 2, 1] + R[:, 1, 2]}  # fmt: skip
    products = np.zeros((len(R), 4, 4))  # 4 q_i q_j
    for (i, j), value in s.items():
        products[:, i, j] = products[:, j, i] = value
    for i in range(4):
        products[:, i, i] = squared[:, i]
    best = products[np.arange(len(R)), np.argmax(squared, axis=1)]
    return _unit(best)
