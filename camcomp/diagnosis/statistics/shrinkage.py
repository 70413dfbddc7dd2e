"""How far the gap shrinks on runs that the fit has not seen, with the interval of one more run."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.statistics.one_more import log_ratio, of_one_more, scatter
from camcomp.ground.datatypes import Floats

USUAL_SPREAD = 0.3  # by which runs differ in the logarithm of the ratio: some cut, some hardly move an axis
USUAL_RUNS = 2  # that this is worth beside those at hand


@dataclass(frozen=True, eq=False)
class Shrinkage:
    """rms in um before and after, ratio = 1 - after / before of all runs, and the 95 % interval of that of one more."""

    before: float
    after: float
    ratio: float
    low: float
    high: float


def shrinkage(before: Sequence[Floats], after: Sequence[Floats]) -> Shrinkage:
    """before, after: squared gaps (n,) mm2 per held-out run, NaN where nothing was measured.

    A cause that stands makes no run worse: the interval ends at 0 unless a run at hand did get worse.
    """
    known = [np.isfinite(b) & np.isfinite(a) for b, a in zip(before, after, strict=True)]
    runs = [(b[k], a[k]) for b, a, k in zip(before, after, known, strict=True) if k.any()]
    if not runs:
        return Shrinkage(0.0, 0.0, 0.0, 0.0, 0.0)
    first, last = (float(np.sqrt(np.mean(np.concatenate([run[i] for run in runs])))) for i in (0, 1))
    ratio = 1.0 - last / first if first > 0 else 0.0
    each = np.array([log_ratio(float(b.mean()), float(a.mean())) for b, a in runs])
    square, freedom = scatter(each)
    square, freedom = square + USUAL_RUNS * USUAL_SPREAD**2, freedom + USUAL_RUNS
    low, high = of_one_more(float(each.mean()), square, freedom, 1.0 + 1.0 / len(each))
    worst = min(0.0, 1.0 - float(np.exp(each.max())))
    return Shrinkage(1e3 * first, 1e3 * last, ratio, min(max(low, worst), ratio), max(high, ratio))
