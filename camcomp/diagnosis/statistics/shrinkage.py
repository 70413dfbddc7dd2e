"""How far the gap shrinks on runs that the fit has not seen, with the interval of one more run: logarithms of the ratio are taken as normal."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from camcomp.ground.datatypes import Floats

SURELY = 0.975  # both ends of 95 %
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


def log_ratio(before: float, after: float) -> float:
    """Logarithm of the ratio of two rms, from their mean squares."""
    return 0.5 * float(np.log(max(after, 1e-300) / max(before, 1e-300)))


def scatter(each: Floats) -> tuple[float, int]:
    """Sum of squares about the mean of values (n,), and its degrees of freedom."""
    return float(((each - each.mean()) ** 2).sum()), len(each) - 1


def of_one_more(middle: float, square: float, freedom: int, more: float) -> tuple[float, float]:
    """95 % interval of the shrinkage (1 less the ratio) of one more. Student's t.

    middle: of the logarithms; square, freedom: what they scatter by; more: variance of one more beside that mean, in
    variances of one.
    """
    freedom = max(freedom, 1)
    half = float(student.ppf(SURELY, freedom)) * float(np.sqrt(square / freedom * more))
    return 1.0 - float(np.exp(middle + half)), 1.0 - float(np.exp(middle - half))
