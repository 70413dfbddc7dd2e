"""Compliance of links that need no table: beams, and a bar held between two hinges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def beam_compliance(length: float, E: float, G: float, A: float, Iy: float, Iz: float, J: float) -> Array:
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
