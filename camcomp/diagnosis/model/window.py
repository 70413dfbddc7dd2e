"""Which rows in succession show a motion that is there for a while: the window whose column explains most of a residual.

With d the motion in a window, r the residual beside columns Q, the chi-square is (d'r)^2 / (d'd - |Q'd|^2); running sums give
it for all windows at once.
"""

from __future__ import annotations

import numpy as np

from camcomp.ground.datatypes import Floats, Ints

LONGEST = 0.6  # of a run's rows: what lasts longer is how the run is
LEAST_FREE = 0.02  # of a window's squares that the other columns have to leave
AT_ONCE = 256  # begins that are looked at together


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
    best = 0.0, 0, 0
    for start in range(0, len(edges), AT_ONCE):
        begin = np.arange(start, min(start + AT_ONCE, len(edges)))
        rows = edges[None, :] - edges[begin, None]
        whole = size[None, :] - size[begin, None]
        free = whole - ((taken[None, :] - taken[begin, None]) ** 2).sum(axis=2)
        good = (rows >= shortest) & (rows <= LONGEST * n) & (free > LEAST_FREE * whole)
        gain = np.where(good, (said[None, :] - said[begin, None]) ** 2 / np.where(good, free, 1.0), 0.0)
        i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
        if gain[i, j] > best[0]:
            best = float(gain[i, j]), int(edges[begin[i]]), int(edges[j])
    return best


def _sums(values: Floats) -> Floats:
    """Running sums (n + 1, ...) of values (n, ...)."""
    return np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
