"""How far does the gap shrink on runs that took no part in the fit, and on one run more?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from camcomp.diagnosis.result.types import ShrinkageStep, UnseenShrinkage
from camcomp.diagnosis.statistics.shrinkage import log_ratio, of_one_more, scatter
from camcomp.ground.datatypes import Floats, Ints

PARTS = 16  # regions of postures or stretches of time of a run
PARTS_OF_ONE = 4  # that a run visits, at least: it differs from the next one by as much as means of these


@dataclass(frozen=True, eq=False)
class JudgedRun:
    """Squares (n,) of the rows of a run after 0, 1, ... causes, and the part (n,) of the run that every row lies in."""

    squares: Sequence[Floats]
    parts: Ints


def unseen_shrinkage(
    runs: Sequence[JudgedRun], causes: Sequence[tuple[str, str | None]], **more: Any
) -> UnseenShrinkage:
    """The shrinkage over runs that weigh alike; causes: effect and target in the order of the squares. more: other fields."""
    size = [
        1e3 * float(np.sqrt(np.mean([s.mean() for s in each]))) for each in zip(*(r.squares for r in runs), strict=True)
    ]
    ratio = 1.0 - size[-1] / size[0] if size[0] > 0.0 else 0.0
    low, high = interval_of_next(runs)
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

    Logarithms of the ratio are taken as normal. They vary from run to run as they do between these, and as means over
    PARTS_OF_ONE parts of a run do. Student's t, the spread pooled over both.
    """
    each = np.array([_ratio(r, np.ones(len(r.parts), bool)) for r in runs])
    square, freedom = scatter(each)
    for r in runs:
        inside, parts = scatter(np.array([_ratio(r, r.parts == part) for part in np.unique(r.parts)]))
        square, freedom = square + inside / PARTS_OF_ONE, freedom + parts
    return of_one_more(float(each.mean()), square, freedom, 1.0 + 1.0 / len(each))


def _ratio(run: JudgedRun, rows: np.ndarray) -> float:
    return log_ratio(float(run.squares[0][rows].mean()), float(run.squares[-1][rows].mean()))
