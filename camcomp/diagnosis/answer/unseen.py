"""How far does the gap shrink on runs that took no part in the fit, and on one run more?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import t as student

from camcomp.diagnosis.result.types import ShrinkageStep, UnseenShrinkage
from camcomp.diagnosis.statistics.folds import PARTS
from camcomp.diagnosis.statistics.probability import SURELY
from camcomp.ground.datatypes import Bools, Floats, Ints

USUAL_SPREAD = 0.3  # by which runs of programs differ in the logarithm of the ratio: some cut, some hardly move an axis
USUAL_RUNS = 2  # that this is worth beside those at hand


@dataclass(frozen=True, eq=False)
class JudgedRun:
    """Squares (n,) of the rows of a run after 0, 1, ... causes, NaN where a row has no value.

    parts (n,): number of the part of the run that every row lies in; None where runs differ by what they do.
    """

    squares: Sequence[Floats]
    parts: Ints | None = None

    @property
    def known(self) -> Bools:
        """Rows (n,) with a value."""
        return np.asarray(np.all(np.isfinite(self.squares), axis=0))

    def of(self, rows: Bools) -> JudgedRun:
        """Some of the rows (n,)."""
        return JudgedRun([s[rows] for s in self.squares], None if self.parts is None else self.parts[rows])

    @property
    def log_ratio(self) -> float:
        """Logarithm of the ratio of the rms without and with all causes."""
        before, after = (max(float(each.mean()), 1e-300) for each in (self.squares[0], self.squares[-1]))
        return 0.5 * float(np.log(after / before))


def unseen_shrinkage(
    runs: Sequence[JudgedRun], causes: Sequence[tuple[str, str | None]], **more: Any
) -> UnseenShrinkage:
    """The shrinkage over all rows; causes: effect and target in the order of the squares. more: other fields."""
    runs = [r.of(r.known) for r in runs if r.known.any()]
    stages = [np.concatenate(each) for each in zip(*(r.squares for r in runs), strict=True)]
    size = [1e3 * float(np.sqrt(each.mean())) for each in stages] or [0.0] * (len(causes) + 1)
    ratio = 1.0 - size[-1] / size[0] if size[0] > 0.0 else 0.0
    low, high = interval_of_next(runs) if runs else (0.0, 0.0)
    return UnseenShrinkage(
        before_rms_um=round(size[0], 3), after_rms_um=round(size[-1], 3), ratio=round(ratio, 4),
        ci95=(round(min(low, ratio), 4), round(max(high, ratio), 4)),
        steps=tuple(
            ShrinkageStep(effect=e, target=t, after_rms_um=round(s, 3))
            for (e, t), s in zip(causes, size[1:], strict=False)
        ),
        **more,
    )  # fmt: skip


def interval_of_next(runs: Sequence[JudgedRun]) -> tuple[float, float]:
    """95 % interval of the shrinkage of one more run.

    Logarithms of the ratio are taken as normal. They vary from run to run as they do between these and, pooled with that,
    as means over PARTS parts of a run do, or as runs usually do. Student's t. A cause that is real makes no run
    worse: the interval ends at 0 unless a run at hand got worse.
    """
    each = np.array([r.log_ratio for r in runs])
    square, freedom = map(float, scatter(each))
    for r in runs:
        if r.parts is None:
            square, freedom = square + USUAL_RUNS * USUAL_SPREAD**2 / len(runs), freedom + USUAL_RUNS / len(runs)
        else:
            inside, parts = scatter(np.array([r.of(r.parts == part).log_ratio for part in np.unique(r.parts)]))
            square, freedom = square + inside / PARTS, freedom + parts
    low, high = of_one_more(float(each.mean()), square, freedom, 1.0 + 1.0 / len(each))
    return max(low, min(0.0, 1.0 - float(np.exp(each.max())))), high


def scatter(each: Floats) -> tuple[float, int]:
    """Sum of squares about the mean of values (n,), and its degrees of freedom."""
    return float(((each - each.mean()) ** 2).sum()), len(each) - 1


def of_one_more(middle: float, square: float, freedom: float, more: float) -> tuple[float, float]:
    """95 % interval of the shrinkage (1 less the ratio) of one more. Student's t.

    middle: of the logarithms; square, freedom: what they scatter by; more: variance of one more beside that mean, in
    variances of one.
    """
    freedom = max(freedom, 1)
    half = float(student.ppf(SURELY, freedom)) * float(np.sqrt(square / freedom * more))
    return 1.0 - float(np.exp(middle + half)), 1.0 - float(np.exp(middle - half))
