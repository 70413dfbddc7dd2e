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


def best_window(
    motion: Floats, left: Floats, basis: Floats, edges: Ints, shortest: int, step: int = 1
) -> tuple[float, int, int]:
    """Chi-square, first row and end row of the best window; 0, 0, 0 where none is admissible.

    Windows are looked for between every `step`-th edge; then the ends of the best one are placed, by half as much each time.

    Args:
        motion: (n, c) of the channels per unit.
        left: (n, c) residual beside the basis.
        basis: (n, c, k) orthonormal columns of all else that is fitted.
        edges: (e,) rows at which windows may begin and end, rising.
        shortest: rows of a window, at least.
        step: of the edges.
    """
    said, size = (_sums((motion * each).sum(axis=1))[edges] for each in (left, motion))
    taken = _sums(np.einsum("nc,nck->nk", motion, basis))[edges]

    def best_of(on: Ints) -> tuple[float, int, int]:
        rows, whole, toward = (each[None, on] - each[on, None] for each in (edges, size, said))
        free = whole - sum((each[None, on] - each[on, None]) ** 2 for each in taken.T)
        good = (rows >= shortest) & (rows <= EVEN * len(left)) & (free > LEAST_FREE * whole)
        gain = np.where(good, toward**2 / np.where(good, free, 1.0), 0.0)
        i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
        return float(gain[i, j]), int(on[i]), int(on[j])

    gain, i, j = best_of(np.arange(0, len(edges), step))
    while gain > 0.0 and step > 1:
        step = -(-step // 2)
        near = np.add.outer([i, j], step * np.arange(-2, 3))
        gain, i, j = best_of(np.unique(np.clip(near, 0, len(edges) - 1)))
    return (gain, int(edges[i]), int(edges[j])) if gain > 0.0 else (0.0, 0, 0)


def _sums(values: Floats) -> Floats:
    """Running sums (n + 1, ...) of values (n, ...)."""
    return np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
