"""Which rows in succession show a motion that is there for a while: the window whose column explains most of a residual.

With d the motion in a window, r the residual beside columns Q, the chi-square is (d'r)^2 / (d'd - |Q'd|^2); running sums give
it for all windows at once. What lasts for more than half of a run is how the run is.
"""

from __future__ import annotations

import numpy as np

from camcomp.diagnosis.statistics.probability import EVEN
from camcomp.ground.datatypes import Floats, Ints

LEAST_FREE = 0.02  # of a window's squares that the other columns have to leave
TRAVEL_BINS = 40  # parts of a travel in which places are told apart


def best_window(motion: Floats, left: Floats, basis: Floats, edges: Ints, shortest: int) -> tuple[float, int, int]:
    """Chi-square, first row and end row of the best window; 0, 0, 0 where none is admissible.

    Args:
        motion: (n, c) of the channels per unit.
        left: (n, c) residual beside the basis.
        basis: (n, c, k) orthonormal columns of all else that is fitted.
        edges: (e,) rows at which windows may begin and end, rising.
        shortest: rows of a window, at least.
    """
    n = len(left)
    said, size = (_sums((motion * each).sum(axis=1))[edges] for each in (left, motion))
    taken = _sums(np.einsum("nc,nck->nk", motion, basis))[edges]
    rows, whole = (each[None, :] - each[:, None] for each in (edges, size))
    free = whole - sum((each[None, :] - each[:, None]) ** 2 for each in taken.T)
    good = (rows >= shortest) & (rows <= EVEN * n) & (free > LEAST_FREE * whole)
    gain = np.where(good, (said[None, :] - said[:, None]) ** 2 / np.where(good, free, 1.0), 0.0)
    i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
    return (float(gain[i, j]), int(edges[i]), int(edges[j])) if gain[i, j] > 0.0 else (0.0, 0, 0)


def _sums(values: Floats) -> Floats:
    """Running sums (n + 1, ...) of values (n, ...)."""
    return np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
