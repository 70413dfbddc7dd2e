"""Compliance of links that need no table: beams, and a bar held between two hinges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from camcomp.model.statics.rotation import cross_matrix

Array = NDArray[np.float64]


def beam_compliance(length: float, E: float, G: float, A: float, Iy: float, *, Iz: float, J: float) -> Array:
    """Tip compliance (6, 6) of an Euler-Bernoulli cantilever along its local x axis; mm, N, rad.

    Tip displacement (translation; rotation) = compliance @ tip wrench (force; moment). length mm, E and G N/mm^2,
    A mm^2, Iy, Iz, J mm^4. Raises ValueError for a value that is not positive.
    Source: standard beam theory (clamped base, load at the tip).
    """
    if min(length, E, G, A, Iy, Iz, J) <= 0.0:
        raise ValueError("a beam needs positive length, moduli and section values")
    C = np.zeros((6, 6))
    C[0, 0] = length / (E * A)
    C[1, 1] = length**3 / (3.0 * E * Iz)
    C[2, 2] = length**3 / (3.0 * E * Iy)
    C[3, 3] = length / (G * J)
    C[4, 4] = length / (E * Iy)
    C[5, 5] = length / (E * Iz)
    C[1, 5] = C[5, 1] = length**2 / (2.0 * E * Iz)
    C[2, 4] = C[4, 2] = -(length**2) / (2.0 * E * Iy)
    return C


def hinged_bar_stiffness(bar_stiffness: Array, arm: Array, hinge: Array) -> Array:
    """Stiffness (6, 6) at the far end of a bar that is hinged at both ends about the same axis.

    bar_stiffness: tip stiffness (6, 6) of the bar clamped at its base; arm (3,) mm from near to far hinge; hinge (3,).
    The two hinge twists cost no energy, so the result has rank 4 or less:
    top-left block of inv([[C, Jq], [Jq^T, 0]]) = K - K Jq (Jq^T K Jq)^-1 Jq^T K.
    """
    near = np.concatenate((np.cross(hinge, arm), hinge))
    far = np.concatenate((np.zeros(3), hinge))
    scale = max(float(np.linalg.norm(arm)), 1.0)
    Jq = np.column_stack((near / scale, far))
    KJ = bar_stiffness @ Jq
    K = bar_stiffness - KJ @ np.linalg.solve(Jq.T @ KJ, KJ.T)
    K = 0.5 * (K + K.T)
    K[np.abs(K) < 1e-12 * np.abs(bar_stiffness)] = 0.0
    return K


def swinging_pair(bar: Array, half: Array) -> tuple[Array, Array]:
    """Stiffness of two hinged bars at +-half of a cross-bar that keeps its orientation while the arm swings by q.

    bar (6, 6): stiffness of one bar (hinged_bar_stiffness) in the arm's frame, whose y is the hinge; half (3,) mm: half
    the cross-bar in the same frame at q = 0. Returns (K, by_swing): K (6, 6) constant, by_swing (4, 6, 6) coefficients of
    cos^2 q, cos q sin q, cos q, sin q. The sum is 2 (bar + E^T B E) with E = -[r(q)],
    r(q) = Ry(-q) half and B the translational block of the bar; r = cos q A + sin q S + C is quadratic after E.
    """
    x, y, z = half
    A, S, C = (cross_matrix(v) for v in ((x, 0.0, z), (-z, 0.0, x), (0.0, y, 0.0)))
    B = bar[:3, :3]

    def pair(one: Array, other: Array) -> Array:
        return 2.0 * (one.T @ B @ other + other.T @ B @ one) / (2.0 if one is other else 1.0)

    K = 2.0 * bar
    K[3:, 3:] += pair(C, C) + pair(S, S)  # sin^2 = 1 - cos^2
    by_swing = np.zeros((4, 6, 6))
    by_swing[:, 3:, 3:] = pair(A, A) - pair(S, S), pair(A, S), pair(A, C), pair(S, C)
    return K, by_swing
