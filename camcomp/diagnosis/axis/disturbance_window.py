"""In which rows of one run may the drive force of an axis be shifted by a disturbance?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from camcomp.diagnosis.model.window import best_window
from camcomp.ground.datatypes import Floats

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
    best = 0.0, 0, 0, 0, 1
    for k, rest in rests.items():
        step = float(np.median(np.diff(times[k])))
        cell = max(round(CELL_S / step), 1, len(rest) // 400)
        edges, shortest = np.arange(0, len(rest) - cell + 1, cell), cell * max(round(SHORTEST_S / (cell * step)), 2)
        score, first, last = best_window(np.ones((len(rest), 1)), rest[:, None], bases[k][:, None], edges, shortest)
        best = max(best, (score, k, first, last, cell))
    score, k, first, last, cell = best
    if not score > 0.0:
        return None
    first, last = _placed(_with_shift(rests[k], bases[k], first, last), first, last, FARTHEST * cell)
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


def _with_shift(rest: Floats, base: Floats, first: int, last: int) -> Floats:
    """A run (n,) minus the part of a basis (n, k) that is fitted jointly with a shift in a window."""
    inside = base[first:last].sum(axis=0)
    shift = float(rest[first:last].sum() / max(last - first - float(inside @ inside), 1e-300))
    return np.asarray(rest + shift * (base @ inside))


def rising(push: Floats, time: Floats, rise_s: float) -> Floats:
    """What a force (n,) N in a window is not known to where it comes and goes, row by row: half of what it changes by."""
    reach = 2 * max(round(rise_s / float(np.median(np.diff(time)))), 1) + 1
    return np.asarray(0.5 * (maximum_filter1d(push, reach) - minimum_filter1d(push, reach)))


def _placed(rest: Floats, first: int, last: int, reach: int) -> tuple[int, int]:
    """Both ends moved by up to `reach` rows to where the step is."""

    def step_at(near: int) -> int:
        low, high = max(near - reach, 1), min(near + reach, len(rest) - 1)
        a, b = max(low - reach, 0), min(high + reach, len(rest))
        cuts = np.arange(low, high + 1)
        sums = np.concatenate([[0.0], np.cumsum(rest[a:b])])
        n, m = cuts - a, b - cuts
        before, behind = sums[cuts - a] / n, (sums[-1] - sums[cuts - a]) / np.maximum(m, 1)
        return int(cuts[np.argmax((before - behind) ** 2 * n * m)])

    return (step_at(first) if first > 0 else 0), step_at(last)
