"""The stretch of an actuator's travel in which a gap stands out: a bump, a worn place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.fit.bench import thinned
from camcomp.diagnosis.fit.cause_sets import Fitted
from camcomp.diagnosis.fit.gap import main_channels
from camcomp.diagnosis.fit.outliers import medians
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.window import TRAVEL_BINS
from camcomp.diagnosis.result.types import Driver, StretchDriver
from camcomp.ground.datatypes import Floats


def with_stretches(drivers: Sequence[Driver], problem: Problem, f: Fitted) -> list[Driver]:
    """The drivers; a position among them with the stretch in which what `f` leaves stands out, where there is one."""
    if not any(_asked(each) for each in drivers):
        return list(drivers)
    part, bench = main_channels(problem), problem.bench
    causes = problem.causes(f.members, f.theta, f.extra)
    left = [bench.gap(k, causes)[:, part] for k in range(len(bench.runs))]
    left = [each - medians(each) for each in left]  # what one run is off by stands nowhere on the travel
    where = [thinned(bench.nominal[k].motion.encoder, run.thin) for k, run in enumerate(bench.runs)]
    gap, position = np.concatenate(left), np.concatenate(where)
    channel = int(np.nanargmax(np.nansum(gap**2, axis=0)))
    out: list[Driver] = []
    for each in drivers:
        name = each.covariate.partition(":")[2]
        found = None
        if _asked(each) and name in bench.actuators:
            a = bench.actuators.index(name)
            found = stretch(position[:, a], gap[:, channel])
        if found is None:
            out.append(each)
            continue
        unit = "rad" if problem.bench.twin.robot.actuators[a].revolute else "mm"
        out.append(
            StretchDriver(
                covariate=each.covariate, share=each.share, low=round(found[0], 4), high=round(found[1], 4), unit=unit
            )
        )
    return out


def _asked(driver: Driver) -> bool:
    return driver.covariate.startswith("position:") and driver.share > 0.5


def stretch(position: Floats, gap: Floats) -> tuple[float, float] | None:
    """Ends of the one stretch where the mean gap (n,) over the position (n,) is off its usual value by half its peak.

    None where there is none, where there are several, and where it takes up most of the travel.
    """
    known = np.isfinite(position) & np.isfinite(gap)
    p, g = position[known], gap[known]
    if len(p) < TRAVEL_BINS or np.ptp(p) <= 0.0:
        return None
    edges = np.linspace(p.min(), p.max(), TRAVEL_BINS + 1)
    bins = np.clip(np.digitize(p, edges) - 1, 0, TRAVEL_BINS - 1)
    count = np.bincount(bins, minlength=TRAVEL_BINS)
    mean = np.bincount(bins, g, TRAVEL_BINS) / np.maximum(count, 1)
    seen = count > 0
    if seen.sum() < TRAVEL_BINS // 2:
        return None
    off = np.where(seen, np.abs(mean - np.median(mean[seen])), 0.0)
    high = np.flatnonzero(off > 0.5 * off.max())
    if not len(high) or high[-1] - high[0] + 1 > 0.5 * TRAVEL_BINS or (np.diff(high) > 2).any():
        return None
    return float(edges[high[0]]), float(edges[high[-1] + 1])
