"""The noise floor: scatter of readings by the instruments and the machine's repeatability, without faults.

It is measured or stated, and never what a fitted model leaves: fast noise from the scatter of neighbouring rows, slow
noise as the repeatability of runs, or both as the experiment states them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, thinned
from camcomp.diagnosis.model.noise import LEAST_VALUES, REPEATABILITY_MM, resolution_of, rounding_noise
from camcomp.ground.datatypes import Floats, Ints
from camcomp.model.seams import missing_rows

CLIPPED = 6.0  # robust deviations beyond which a difference of rows is no noise
LEAST_SHARE = 0.05  # of the floor: what moves the tip by less is the resolution of a channel and no finding
RIGID_MM_PER_N = 1e-4  # spring of a drive for which none is stated
BEND = np.array([1.0, -2.0, 1.0]) / np.sqrt(6.0)  # a second difference whose deviation is that of the noise
STRETCH = 16  # differences of rows that make a stretch
LOWER_QUARTILE = 0.82  # of the scatter of such stretches of white noise, in units of the noise (4000 draws: 0.816)
OUTLIER = len(BEND)  # second differences that hold a single row
UNSTEADY = 1.5  # times the quiet stretches: of 4000 draws of 160 rows of white noise none had it


@dataclass(frozen=True, eq=False)
class NoiseFloor:
    """fast (c,): standard deviation from row to row of every channel, NaN where it has none; slow: of what remembers, per
    axis of the tip, mm; tip_um: both together in three axes.
    """

    fast: Floats
    slow_mm: float
    tip_um: float
    source: Literal["stated", "rows", "not identifiable"]

    @property
    def axis_mm(self) -> float:
        """Per axis of the tip."""
        return float(1e-3 * self.tip_um / np.sqrt(3.0))


def measure_floor(bench: Bench, stated_mm: float | None = None) -> NoiseFloor:
    """The floor of a bench's runs. stated_mm: the whole deviation of the tip's instrument per axis, where the user states it."""
    gaps = [bench.residual(k) for k in range(len(bench.runs))]
    times = [thinned(run.run_path.time, run.thin) for run in bench.runs]
    fast = np.full(gaps[0].shape[1], np.nan)
    for c in range(len(fast)):
        scatter = steady_scatter if c < 3 else row_scatter
        sizes = [scatter(g[:, c], t) for g, t in zip(gaps, times, strict=True)]
        known = np.array([s for s in sizes if np.isfinite(s)])
        if len(known):  # one sensor: a run whose corners scatter has not the sensor's noise
            fast[c] = float(np.median(known))
    per_row = [run.measured.tip_sd for run in bench.runs if np.isfinite(run.measured.tip_sd).any()]
    if stated_mm is None and per_row:
        stated_mm = float(np.sqrt(np.mean([np.nanmean(sd**2) for sd in per_row])))
    tip = fast[:3][np.isfinite(fast[:3])]
    white = float(np.sqrt(np.mean(tip**2))) if len(tip) else 0.0
    if stated_mm is not None:
        axis = max(stated_mm, white)
        slow = float(np.sqrt(max(stated_mm**2 - white**2, 0.0)))
        return NoiseFloor(fast, slow, 1e3 * np.sqrt(3.0) * axis, "stated")
    axis = float(np.hypot(white, REPEATABILITY_MM))
    return NoiseFloor(fast, REPEATABILITY_MM, 1e3 * np.sqrt(3.0) * axis, "rows" if len(tip) else "not identifiable")


def row_scatter(values: Floats, time: Floats) -> float:
    """Standard deviation of the noise of values (n,) from their second differences; NaN where they are too few.

    What is smooth does not enter; single rows far off hardly do, heavy tails do.
    """
    bend = _bends(values, time)
    return float("nan") if bend is None else float(np.sqrt(np.mean(bend**2)))


def steady_scatter(values: Floats, time: Floats) -> float:
    """The same of an instrument that sees swings faster than its rows: what it scatters by in its quiet stretches.

    An instrument is as noisy in one stretch as in the next. Where the scatter of stretches differs by more than chance makes
    it, something swings in some of them; then their lower quartile counts, less what chance takes off it.
    """
    bend, whole = _bends(values, time), row_scatter(values, time)
    if bend is None or len(bend) < LEAST_VALUES * STRETCH:
        return whole
    stretches = bend[: len(bend) // STRETCH * STRETCH].reshape(-1, STRETCH)
    quiet = float(np.quantile(np.sqrt(np.mean(stretches**2, axis=1)), 0.25)) / LOWER_QUARTILE
    return quiet if quiet < whole / UNSTEADY else whole


def swings(values: Floats, time: Floats, doubt: Floats, resolution: float) -> tuple[float, float]:
    """Mean square of what swings in some stretches, faster than the rows, and the noise that it exceeds, squared as well.

    Quiet stretches and the rounding tell the noise; single rows far off are outliers and do not count.

    Args:
        values: (n,) of an instrument.
        time: (n,) s.
        doubt: (n,) standard deviation of each row beyond the noise.
        resolution: standard deviation of the rounding.
    """
    rows = _triples(values, time)
    whole = len(rows) // STRETCH * STRETCH
    if whole < 4 * STRETCH:
        return 0.0, 0.0
    energy, allowed = (
        each[:whole].reshape(-1, STRETCH) for each in ((values[rows] @ BEND) ** 2, doubt[rows] ** 2 @ BEND**2)
    )
    usual = np.argsort(energy, axis=1)[:, :-OUTLIER]  # an outlier is in three triples
    energy, allowed = (np.take_along_axis(each, usual, axis=1).sum(axis=1) / STRETCH for each in (energy, allowed))
    noise = max(float(np.quantile(energy, 0.25)), resolution**2)
    return max(float(np.mean(energy - allowed)) - UNSTEADY**2 * noise, 0.0), noise


def _bends(values: Floats, time: Floats) -> Floats | None:
    """Second differences in units of the noise, those far off cut; None where rows are too few."""
    bend = values[_triples(values, time)] @ BEND
    if not len(bend):
        return None
    middle = 1.4826 * float(np.median(np.abs(bend)))
    return np.asarray(bend if middle == 0.0 else np.clip(bend, -CLIPPED * middle, CLIPPED * middle))


def _triples(values: Floats, time: Floats) -> Ints:
    """Rows (m, 3) that follow each other without a gap, of those that have a value; none where these are too few."""
    known = np.flatnonzero(np.isfinite(values))
    if len(known) < LEAST_VALUES:
        return np.empty((0, 3), int)
    near = ~missing_rows(time[known])
    return np.stack([known[:-2], known[1:-1], known[2:]], axis=1)[near[1:] & near[:-1]]


def least_noise(bench: Bench, floor: NoiseFloor) -> Floats:
    """Least standard deviation (c,) of every channel: what moves the tip by LEAST_SHARE of the floor, or one digit.

    The resolution of a channel is noise, and no finding, however sharp.
    """
    size = bench.tip_sizes.max(axis=0)
    least = LEAST_SHARE * floor.axis_mm / np.where(size > 0.0, size, RIGID_MM_PER_N)
    return np.asarray(np.hypot(least, roundings(bench)))


def roundings(bench: Bench) -> Floats:
    """Standard deviation (c,) of every channel's rounding."""
    steps = np.max([[resolution_of(x) for x in bench.observed(k).T] for k in range(len(bench.runs))], axis=0)
    return np.array([rounding_noise(each) for each in steps])
