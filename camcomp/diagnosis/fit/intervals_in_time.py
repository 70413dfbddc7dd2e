"""When something acted for a while: the interval of one run in which its columns explain most of a leftover.

The best interval between blocks of rows (model/window) is refined row by row. Intervals that are
not far beyond what chance makes of so many are none.
"""

from collections.abc import Callable, Sequence
from itertools import combinations
from math import comb

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, CandidateCause
from camcomp.diagnosis.model.noise import IN_A_ROW
from camcomp.diagnosis.model.window import best_window
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS, EVEN
from camcomp.ground.datatypes import Floats, Ints

_BLOCKS = 60
_JUMPS = 5  # of a leftover, between which an interval is tried


def log_intervals(runs: int) -> float:
    """Logarithm of the number of intervals of so many runs to choose from, against a cause that has to be sought in time."""
    return float(np.log(runs * comb(_BLOCKS, 2)))


def never_ending(candidate: CandidateCause) -> dict[str, float]:
    """The instants of an effect that acts all the time."""
    return dict(zip((p.name for p in candidate.shapes), (-1e9, 1e9), strict=True))


def likely_intervals(
    bench: Bench, candidate: CandidateCause, always: Sequence[ByChannel], rest: Sequence[Floats],
    places: Callable[[int], Floats],
) -> list[dict[str, float]]:  # fmt: skip
    """Intervals of time, by the names of the candidate's shapes, in which it explains much of `rest` (white, per run).

    always: white columns (w, p) per run of the candidate acting all the time. places: position of a run's white rows in
    its time, 0 to 1. Empty where no gain exceeds, by odds of EQUAL_LOG_ODDS, what so many intervals make by chance. The
    first interval has the largest gain. Noise with a long memory hides all of a shift but its begin and end; therefore
    the further intervals lie between the largest jumps.
    """
    start, end = (each.name for each in candidate.shapes)
    least = 2.0 * (log_intervals(len(bench.runs)) + EQUAL_LOG_ODDS)
    best: tuple[float, list[tuple[float, float]]] = (least, [])
    for k, run in enumerate(bench.runs):
        order = np.argsort(places(k), kind="stable")
        at = run.run_path.started + run.run_path.time[0] + places(k)[order] * np.ptp(run.run_path.time)
        instants, starts = np.unique(at, return_index=True)
        if len(instants) < 4 * IN_A_ROW:
            continue
        columns = always[k][:, np.arange(always[k].width)][order]
        gain, i, j = max(_best(column, rest[k][order], starts) for column in columns.T)
        if gain > best[0]:
            rise = getattr(candidate.effect, "RISE_S", 0.0)
            jumps = _jumps(np.add.reduceat(rest[k][order] ** 2, starts))
            pairs = [(i, j), *(pair for pair in combinations(sorted({i, j, *jumps}), 2) if pair != (i, j))]
            fair = [(i, j) for i, j in pairs if IN_A_ROW <= j - i <= EVEN * len(instants)]
            best = gain, [_between(instants, i, j, rise) for i, j in fair]
    return [{start: begin, end: over} for begin, over in best[1]]


def _between(instants: Floats, i: int, j: int, rise: float) -> tuple[float, float]:
    """Half way to the rows outside i to j - 1, and early enough for the rows inside to see all of it."""
    before, behind = (
        0.5 * (instants[b] - instants[a]) for a, b in ((max(i - 1, 0), i), (j - 1, min(j, len(instants) - 1)))
    )
    return float(instants[i] - max(before, rise)), float(instants[j - 1] + max(behind, rise))


def _jumps(energy: Floats) -> list[int]:
    """The instants (of n) with the largest jumps of a residual, at least IN_A_ROW rows apart."""
    left, out = energy.copy(), list[int]()
    for _ in range(min(_JUMPS, len(left) // IN_A_ROW)):
        at = int(np.argmax(left))
        out.append(at)
        left[max(at - IN_A_ROW, 0) : at + IN_A_ROW + 1] = 0.0
    return out


def _best(column: Floats, rest: Floats, starts: Ints) -> tuple[float, int, int]:
    """Gain, first instant and the one behind the last of the best interval of rows (w,) in time; starts: first row of every
    instant.
    """
    n, ends = len(starts), np.append(starts, len(rest))
    motion, none = column[:, None], np.zeros((len(rest), 1, 0))
    gain, *rows = best_window(motion, rest[:, None], none, ends, IN_A_ROW * len(rest) // n, step=-(-n // _BLOCKS))
    i, j = np.searchsorted(ends, rows).tolist()
    return gain, i, j
