"""Whether something pushed an axis for a while: a window of one run in which its drive force is shifted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from camcomp.diagnosis.axis.terms import AxisTravel
from camcomp.ground.datatypes import Floats, Ints

CELL_S = 0.02  # in which a window begins and ends, before it is placed to a row
SHORTEST_S, LONGEST = 0.2, 0.6  # of a window; of its run: what lasts longer is how the run is
LEVEL = 0.5  # of the shift: every quarter of a window has to show it to within that
QUARTERS = 4
LEAST_SIZE = 2.0  # of the floor, that a push has to be: a force's zero wanders by less
PLACES = 40  # of the travel, each way of its own
BEEN = 0.5  # of a window's rows, at places where the axis was at other times as well
FARTHEST = 3  # cells by which an end is moved to its row
SHARP_S, SHARP = (
    0.02,
    0.6,
)  # beyond an end, at least two rows; of the shift that has to be gone there: no place ends like that


@dataclass(frozen=True)
class Window:
    """Rows first to last (exclusive) of a run, counted from 0; shift N; log10 of the chance that noise looks like this."""

    run: int
    first: int
    last: int
    shift: float
    chance: float


def find_window(left: Sequence[Floats], times: Sequence[Floats], floor: float) -> Window | None:
    """The window of leftovers (n,) N per run that stands out most, where it is a push: as large throughout as it is on average."""
    best: Window | None = None
    tried = 0
    for k, (rest, time) in enumerate(zip(left, times, strict=True)):
        step = float(np.median(np.diff(time)))
        cell = max(round(CELL_S / step), 1, len(rest) // 400)
        edges = np.arange(0, len(rest) - cell + 1, cell)
        sums = np.concatenate([[0.0], np.cumsum(rest)])[edges]
        i, j = np.triu_indices(len(edges), max(round(SHORTEST_S / (cell * step)), 2))
        n = edges[j] - edges[i]
        some = n < LONGEST * len(rest)
        i, j, n = i[some], j[some], n[some]
        if not len(n):
            continue
        # against the rest of the run: a shift of all of it is none
        whole = float(rest.sum())
        inside = sums[j] - sums[i]
        apart = inside / n - (whole - inside) / (len(rest) - n)
        score = apart**2 * n * (len(rest) - n) / len(rest)
        at = int(np.argmax(score))
        tried += len(n)
        first, last = _placed(rest, int(edges[i[at]]), int(edges[j[at]]), FARTHEST * cell)
        chance = float(norm.logsf(np.sqrt(score[at]) / floor) / np.log(10.0))
        if best is None or chance < best.chance:
            best = Window(k, first, last, float(apart[at]), chance)
    if (
        best is None
        or abs(best.shift) < LEAST_SIZE * floor
        or times[best.run][best.last - 1] - times[best.run][best.first] < SHORTEST_S
    ):
        return None
    rest = left[best.run]
    outside = float(np.mean(np.concatenate([rest[: best.first], rest[best.last :]])))
    parts = [float(np.mean(p)) - outside for p in np.array_split(rest[best.first : best.last], QUARTERS)]
    even = all(abs(p - best.shift) < LEVEL * abs(best.shift) for p in parts)
    return (
        Window(best.run, best.first, best.last, best.shift, min(best.chance + np.log10(tried), 0.0)) if even else None
    )


def seen_elsewhere(window: Window, moves: Sequence[AxisTravel]) -> bool:
    """Whether the axis was where the window was at other times as well, the same way: else it may be the place that pushes."""
    every = np.concatenate([m.position for m in moves])
    low, span = float(every.min()), max(float(np.ptp(every)), 1e-9)

    def places(m: AxisTravel) -> Ints:
        place = np.minimum((PLACES * (m.position - low) / span).astype(int), PLACES - 1)
        return np.asarray(3 * place + np.sign(np.round(m.speed, 6)).astype(int) + 1)

    at = [places(m) for m in moves]
    mine = at[window.run][window.first : window.last]
    others = [np.delete(p, slice(window.first, window.last)) if k == window.run else p for k, p in enumerate(at)]
    return float(np.isin(mine, np.concatenate(others)).mean()) > BEEN


def placed_again(window: Window, rest: Floats, time: Floats, floor: float) -> Window:
    """The window where leftovers (n,) N of its own run have it, what else moves the axis being fitted beside it by now."""
    found = find_window([rest], [time], floor)
    if found is None or min(found.last, window.last) <= max(found.first, window.first):
        return window
    return replace(found, run=window.run, chance=min(found.chance, window.chance))


def edges(window: Window, time: Floats) -> Floats:
    """N (n,) that rows of its run are not known to for it: at its ends, which no log shows sharper than SHARP_S."""
    ends = time[[window.first, min(window.last, len(time) - 1)]]
    near = np.min(np.abs(time[:, None] - ends), axis=1) < SHARP_S
    return np.where(near, abs(window.shift), 0.0)


def sharp(window: Window, rest: Floats, time: Floats) -> bool:
    """Whether leftovers (n,) N of the window's run jump at both of its ends, neither of them an end of the run."""
    reach = max(round(SHARP_S / float(np.median(np.diff(time)))), 2)
    if window.first < reach or window.last + reach > len(rest):
        return False
    ends = [(window.first, -1), (window.last, 1)]
    jumps = [np.mean(_beside(rest, at, -side, reach)) - np.mean(_beside(rest, at, side, reach)) for at, side in ends]
    return all(float(jump) / window.shift > SHARP for jump in jumps)


def _beside(rest: Floats, at: int, side: int, reach: int) -> Floats:
    return rest[at : at + reach] if side > 0 else rest[at - reach : at]


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
