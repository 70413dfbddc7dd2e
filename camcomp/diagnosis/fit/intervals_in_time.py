"""When something acted for a while: the interval of one run in which its columns explain most of a leftover.

The gain of every interval between blocks of rows comes from running sums; the best is refined row by row. Intervals that are
not far beyond what chance makes of so many are none.
"""

from collections.abc import Callable, Sequence
from itertools import combinations
from math import comb

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, CandidateCause
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.ground.datatypes import Floats

LEAST_GAIN = 60.0  # chi-square of one interval; the best of 1e5 by chance is 20
LONGEST = 0.5  # of a run: what acts for longer is no disturbance
LEAST_ROWS = 5
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
    its time, 0 to 1. Empty where every gain is below LEAST_GAIN. The first interval has the largest gain. Noise with a
    long memory hides all of a shift but its begin and end; therefore the further intervals lie between the largest
    jumps.
    """
    start, end = (each.name for each in candidate.shapes)
    best: tuple[float, list[tuple[float, float]]] = (LEAST_GAIN, [])
    for k, run in enumerate(bench.runs):
        columns = always[k][:, np.arange(always[k].width)]
        order = np.argsort(places(k), kind="stable")
        at = run.run_path.started + run.run_path.time[0] + places(k)[order] * np.ptp(run.run_path.time)
        instants, rows = np.unique(at, return_inverse=True)
        if len(instants) < 4 * LEAST_ROWS:
            continue
        d = columns.shape[1]
        hits, size = np.zeros((len(instants) + 1, d)), np.zeros((len(instants) + 1, d, d))
        for a in range(d):
            hits[1:, a] = np.cumsum(np.bincount(rows, (columns[:, a] * rest[k])[order]))
            for b in range(d):
                size[1:, a, b] = np.cumsum(np.bincount(rows, (columns[:, a] * columns[:, b])[order]))
        gain, i, j = _best(hits, size, len(instants))
        if gain > best[0]:
            rise = getattr(candidate.effect, "RISE_S", 0.0)
            jumps = _jumps(np.asarray(np.bincount(rows, (rest[k] ** 2)[order]), np.float64))
            pairs = [(i, j), *(pair for pair in combinations(sorted({i, j, *jumps}), 2) if pair != (i, j))]
            fair = [(i, j) for i, j in pairs if LEAST_ROWS <= j - i <= LONGEST * len(instants)]
            best = gain, [_between(instants, i, j, rise) for i, j in fair]
    return [{start: begin, end: over} for begin, over in best[1]]


def _between(instants: Floats, i: int, j: int, rise: float) -> tuple[float, float]:
    """Half way to the rows outside i to j - 1, and early enough for the rows inside to see all of it."""
    before, behind = (
        0.5 * (instants[b] - instants[a]) for a, b in ((max(i - 1, 0), i), (j - 1, min(j, len(instants) - 1)))
    )
    return float(instants[i] - max(before, rise)), float(instants[j - 1] + max(behind, rise))


def _jumps(energy: Floats) -> list[int]:
    """The instants (of n) with the largest jumps of a residual, at least LEAST_ROWS rows apart."""
    left, out = energy.copy(), list[int]()
    for _ in range(min(_JUMPS, len(left) // LEAST_ROWS)):
        at = int(np.argmax(left))
        out.append(at)
        left[max(at - LEAST_ROWS, 0) : at + LEAST_ROWS + 1] = 0.0
    return out


def _best(hits: Floats, size: Floats, n: int) -> tuple[float, int, int]:
    """Gain, first instant and the one behind the last of the best interval; running sums (n + 1, d), (n + 1, d, d)."""
    edges = np.unique(np.linspace(0, n, min(_BLOCKS, n) + 1).astype(np.int64))
    gain, i, j = _among(hits, size, edges, edges, n)
    near = int(np.ceil(n / _BLOCKS))
    for _ in range(2):
        firsts, lasts = (np.arange(max(at - near, 0), min(at + near, n) + 1) for at in (i, j))
        gain, i, j = _among(hits, size, firsts, lasts, n)
    return gain, i, j


def _among(hits: Floats, size: Floats, firsts: np.ndarray, lasts: np.ndarray, n: int) -> tuple[float, int, int]:
    length = lasts[None, :] - firsts[:, None]
    energy = size[lasts][None, :] - size[firsts][:, None]
    sums = hits[lasts][None, :] - hits[firsts][:, None]
    whole = np.trace(energy, axis1=2, axis2=3)
    fair = (length >= LEAST_ROWS) & (length <= LONGEST * n) & (whole > 0.0)
    eye = np.eye(sums.shape[2])
    energy = np.where(fair[:, :, None, None], energy + 1e-9 * whole[:, :, None, None] * eye, eye)
    gain = np.where(fair, np.sum(sums * np.linalg.solve(energy, sums[..., None])[..., 0], axis=2), 0.0)
    a, b = np.unravel_index(int(np.argmax(gain)), gain.shape)
    return float(gain[a, b]), int(firsts[a]), int(lasts[b])
