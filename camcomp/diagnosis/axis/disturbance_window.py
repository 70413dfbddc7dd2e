"""In which rows of one run may the drive force of an axis be shifted by a disturbance?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from camcomp.diagnosis.model.window import best_window
from camcomp.ground.datatypes import Floats, Ints

CELL_S = 0.02  # in which a window begins and ends, before it is placed to a row
SHORTEST_S = 0.2  # of a window
FARTHEST = 3  # cells by which an end is moved to its row


@dataclass(frozen=True)
class Window:
    """Rows first to last (exclusive) of a run, counted from 0."""

    run: int
    first: int
    last: int


def find_window(
    values: Mapping[int, Floats], beside: Mapping[int, Floats], times: Mapping[int, Floats]
) -> Window | None:
    """The window of forces (n,) N by run in which a shift explains most.

    beside: columns (n, k) that are fitted to the same runs, so that friction and inertia have no part in how long it lasts.
    """
    rests, bases = _projected(values, beside)

    def best(k: int, edges: Ints, shortest: int) -> tuple[float, int, int]:
        return best_window(np.ones((len(rests[k]), 1)), rests[k][:, None], bases[k][:, None], edges, shortest)

    cells = {
        k: max(round(CELL_S / float(np.median(np.diff(times[k])))), 1, len(rest) // 400) for k, rest in rests.items()
    }
    rows = {k: max(round(SHORTEST_S / float(np.median(np.diff(times[k])))), 2) for k in rests}
    coarse = {k: best(k, np.arange(0, len(rest) - cells[k] + 1, cells[k]), rows[k]) for k, rest in rests.items()}
    k = max(coarse, key=lambda each: coarse[each][0])
    if not coarse[k][0] > 0.0:
        return None
    near = np.arange(-FARTHEST * cells[k], FARTHEST * cells[k] + 1)
    edges = np.unique(np.clip([end + near for end in coarse[k][1:]], 0, len(rests[k])))
    _, first, last = best(k, edges, rows[k])
    return Window(k, first, last) if times[k][last - 1] - times[k][first] >= SHORTEST_S else None


def _projected(
    values: Mapping[int, Floats], beside: Mapping[int, Floats]
) -> tuple[dict[int, Floats], dict[int, Floats]]:
    """What columns and a constant per run leave of the values (n,), and an orthonormal basis (n, k) of these, by run."""
    ends = np.cumsum([len(each) for each in values.values()])[:-1]
    ones = [np.ones((len(each), 1)) for each in values.values()]
    A = np.concatenate([np.concatenate([beside[k] for k in values]), block_diag(*ones)], axis=1)
    U, size, _ = np.linalg.svd(A / (np.sqrt(np.mean(A**2, axis=0)) + 1e-300), full_matrices=False)
    Q = U[:, size > 1e-9 * size[0]]
    y = np.concatenate([*values.values()])
    rests = dict(zip(values, np.split(y - Q @ (Q.T @ y), ends), strict=True))
    bases = dict(zip(values, np.split(Q, ends), strict=True))
    return rests, bases


def rising(push: Floats, time: Floats, rise_s: float) -> Floats:
    """What a force (n,) N in a window is not known to where it comes and goes, row by row: half of what it changes by."""
    reach = 2 * max(round(rise_s / float(np.median(np.diff(time)))), 1) + 1
    return np.asarray(0.5 * (maximum_filter1d(push, reach) - minimum_filter1d(push, reach)))
