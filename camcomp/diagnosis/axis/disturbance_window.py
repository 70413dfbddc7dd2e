"""Is there a disturbance force: a window of one run in which the drive force of an axis is shifted?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from camcomp.diagnosis.axis.terms import AxisTravel
from camcomp.diagnosis.model.window import TRAVEL_BINS, best_window
from camcomp.diagnosis.statistics.folds import PARTS
from camcomp.diagnosis.statistics.probability import EVEN
from camcomp.ground.datatypes import Floats, Ints

END_S = 0.02  # in which most of a push comes or goes, two rows at least; no place ends like that
SHORTEST_S = 0.2  # of a window
LEAST_SIZE = 2.0  # of the floor, that a push has to be: a force's zero wanders by less


@dataclass(frozen=True)
class Window:
    """Rows first to last (exclusive) of a run, counted from 0; shift N."""

    run: int
    first: int
    last: int
    shift: float


def find_window(
    values: Mapping[int, Floats], beside: Mapping[int, Floats], times: Mapping[int, Floats], floor: float
) -> tuple[Window, Floats] | None:
    """The window of forces (n,) N by run that explains most, where it is as long and as large as a push, and so throughout.

    beside: columns (n, k) that are fitted to the same runs, so that friction and inertia have no part in how long a push lasts.
    With what all else leaves of the window's run (n,), the push still in it.
    """
    rests, bases = _projected(values, beside)

    def best_of(k: int) -> tuple[float, int, int]:
        n, step = len(rests[k]), float(np.median(np.diff(times[k])))
        cell, shortest = max(round(END_S / step), 1, n // 400), max(round(SHORTEST_S / step), 2)
        return best_window(
            np.ones((n, 1)), rests[k][:, None], bases[k][:, None], np.arange(n + 1), shortest=shortest, step=cell
        )

    found = {k: best_of(k) for k in rests}
    k = max(found, key=lambda each: found[each][0])
    gain, first, last = found[k]
    if not gain > 0.0:
        return None
    shift, rest = _alone(rests[k], bases[k], first, last)
    if abs(shift) < LEAST_SIZE * floor or times[k][last - 1] - times[k][first] < SHORTEST_S:
        return None
    parts = [float(np.mean(part)) for part in np.array_split(rest[first:last], min(PARTS, last - first))]
    return (Window(k, first, last, shift), rest) if all(abs(p - shift) < 0.5 * abs(shift) for p in parts) else None


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


def _alone(rest: Floats, base: Floats, first: int, last: int) -> tuple[float, Floats]:
    """Size of a window, fitted jointly with a basis (n, k), and the run (n,) minus the basis part of that fit."""
    inside = base[first:last].sum(axis=0)
    shift = float(rest[first:last].sum() / max(last - first - float(inside @ inside), 1e-300))
    return shift, np.asarray(rest + shift * (base @ inside))


def seen_elsewhere(window: Window, moves: Sequence[AxisTravel]) -> bool:
    """Whether the axis was where the window was at other times as well, the same way: else it may be the place that pushes."""
    every = np.concatenate([m.position for m in moves])
    low, span = float(every.min()), max(float(np.ptp(every)), 1e-9)

    def places(m: AxisTravel) -> Ints:
        place = np.minimum((TRAVEL_BINS * (m.position - low) / span).astype(int), TRAVEL_BINS - 1)
        return np.asarray(3 * place + np.sign(np.round(m.speed, 6)).astype(int) + 1)

    at = [places(m) for m in moves]
    mine = at[window.run][window.first : window.last]
    others = [np.delete(p, slice(window.first, window.last)) if k == window.run else p for k, p in enumerate(at)]
    return float(np.isin(mine, np.concatenate(others)).mean()) > EVEN


def sharp(window: Window, rest: Floats, time: Floats) -> bool:
    """Whether residuals (n,) N of the window's run jump at both of its ends, and both lie inside the run."""
    reach = max(round(END_S / float(np.median(np.diff(time)))), 2)
    if window.first < reach or window.last + reach > len(rest):
        return False
    ends = [(window.first, -1), (window.last, 1)]
    jumps = [np.mean(_beside(rest, at, -side, reach)) - np.mean(_beside(rest, at, side, reach)) for at, side in ends]
    return all(float(jump) / window.shift > 0.5 for jump in jumps)


def rising(push: Floats, time: Floats, rise_s: float) -> Floats:
    """Uncertainty (n,) N of a force in a window at its ends, row by row: half of its change."""
    reach = 2 * max(round(rise_s / float(np.median(np.diff(time)))), 1) + 1
    return np.asarray(0.5 * (maximum_filter1d(push, reach) - minimum_filter1d(push, reach)))


def _beside(rest: Floats, at: int, side: int, reach: int) -> Floats:
    return rest[at : at + reach] if side > 0 else rest[at - reach : at]
