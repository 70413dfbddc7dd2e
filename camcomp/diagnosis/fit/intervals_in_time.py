"""When something acted for a while: the window of rows of one run (model/window) in which its columns explain most of what is left.

Windows that are not far beyond what chance makes of so many are none.
"""

from collections.abc import Sequence
from math import comb

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, CandidateCause
from camcomp.diagnosis.model.noise import IN_A_ROW
from camcomp.diagnosis.model.window import best_window
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS
from camcomp.ground.datatypes import Floats

_BLOCKS = 60


def log_intervals(runs: int) -> float:
    """Logarithm of the number of intervals of so many runs to choose from, against a cause that has to be sought in time."""
    return float(np.log(runs * comb(_BLOCKS, 2)))


def never_ending(candidate: CandidateCause) -> dict[str, float]:
    """The instants of an effect that acts all the time."""
    return dict(zip((p.name for p in candidate.shapes), (-1e9, 1e9), strict=True))


def likely_interval(
    bench: Bench, candidate: CandidateCause, always: Sequence[Floats], left: Sequence[Floats], times: Sequence[Floats]
) -> dict[str, float] | None:
    """The interval of time, by the names of the candidate's shapes, in which it explains most of what is left of a run.

    None where no gain exceeds, by odds of EQUAL_LOG_ODDS, what so many intervals make by chance.

    Args:
        bench: the runs.
        candidate: the cause.
        always: (n, c, p) per run of the candidate acting all the time, in units of the noise.
        left: (n, c) per run, in units of the noise.
        times: (n,) s per run.
    """
    most, best = 2.0 * (log_intervals(len(bench.runs)) + EQUAL_LOG_ODDS), None
    for run, columns, rest, time in zip(bench.runs, always, left, times, strict=True):
        n = len(time)
        if not run.run_path.ordered or n < 4 * IN_A_ROW:
            continue
        for motion in np.moveaxis(columns, 2, 0):
            none, edges = np.zeros((*rest.shape, 0)), np.arange(n + 1)
            gain, first, over = best_window(motion, rest, none, edges, IN_A_ROW, step=-(-n // _BLOCKS))
            if gain > most:
                ends = _between(run.run_path.started + time, first, over, getattr(candidate.effect, "RISE_S", 0.0))
                most, best = gain, dict(zip((each.name for each in candidate.shapes), ends, strict=True))
    return best


def _between(instants: Floats, i: int, j: int, rise: float) -> tuple[float, float]:
    """Half way to the rows outside i to j - 1, and early enough for the rows inside to see all of it."""
    before, behind = (
        0.5 * (instants[b] - instants[a]) for a, b in ((max(i - 1, 0), i), (j - 1, min(j, len(instants) - 1)))
    )
    return float(instants[i] - max(before, rise)), float(instants[j - 1] + max(behind, rise))
