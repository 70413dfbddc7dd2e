"""Course of a parameter over the days: steady, drift or jumps, and the day of its next measurement.

Estimates of n days with known deviations are described by one value, a straight line, or values that change at some
days. The Bayesian information criterion chooses (Schwarz 1978), a richer description by EQUAL_LOG_ODDS more; a jump counts its day as a parameter (Yao 1988).
Least squares over all divisions by dynamic programming (Jackson et al. 2005).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS
from camcomp.ground.datatypes import Floats

FEWEST = 4  # measurements needed for a line or a jump


@dataclass(frozen=True, kw_only=True)
class Course:
    """Course of a value. level, level_sd: present value; rate, rate_sd: per day (drift); jumps: rows at which it changed."""

    kind: Literal["steady", "drift", "jumps", "too few"]
    level: float
    level_sd: float
    rate: float = 0.0
    rate_sd: float = 0.0
    jumps: tuple[int, ...] = ()


def course_of(days: Floats, values: Floats, deviations: Floats) -> Course:
    """The course of values (n,) with standard deviations (n,) measured at days (n,), in order of the days."""
    n, weight = len(days), 1.0 / np.maximum(deviations, 1e-300) ** 2
    line, misfit = _line(days, values, weight)
    cost: list[tuple[float, Course]] = [(misfit + 2 * np.log(n) + 2.0 * EQUAL_LOG_ODDS, line)]
    for count, (starts, misfit) in enumerate(_steps(values, weight)):
        price = (1 + 2 * count) * np.log(n) + 2.0 * EQUAL_LOG_ODDS * count
        if price > min(each for each, _ in cost):  # of so many jumps alone
            break
        last = slice(starts[-1], n)
        own = Course(
            kind="jumps" if count else "steady" if n >= FEWEST else "too few", jumps=tuple(starts[1:]),
            level=float(np.average(values[last], weights=weight[last])), level_sd=float(weight[last].sum() ** -0.5),
        )  # fmt: skip
        if n < FEWEST:
            return own
        cost.append((misfit + price, own))
    return min(cost, key=lambda each: each[0])[1]


def days_until(course: Course, limit: float, most: float = 730.0) -> float:
    """Days from the last measurement until the value may have changed by more than `limit` (95 %), at most `most`.

    For a steady value the drift is bounded by the deviation of its fitted line.
    """
    rate = abs(course.rate) + 1.96 * course.rate_sd
    room = limit - 1.96 * course.level_sd
    if room <= 0.0:
        return 0.0
    return float(min(room / rate, most)) if rate > 0.0 else most


def drift_bound(days: Floats, deviations: Floats) -> float:
    """Deviation of the slope (per day) of a line through measurements at days (n,) with deviations (n,); 0 for fewer than two."""
    return _line(days, np.zeros(len(days)), 1.0 / np.maximum(deviations, 1e-300) ** 2)[0].rate_sd


def _line(days: Floats, values: Floats, weight: Floats) -> tuple[Course, float]:
    """The straight line through the values, and its weighted sum of squared residuals."""
    matrix = np.column_stack((np.ones(len(days)), days - days[-1]))
    covariance = np.linalg.pinv(matrix.T @ (weight[:, None] * matrix))
    now, rate = covariance @ (matrix.T @ (weight * values))
    sd, rate_sd = np.sqrt(np.diag(covariance))
    line = Course(kind="drift", level=float(now), level_sd=float(sd), rate=float(rate), rate_sd=float(rate_sd))
    return line, float(np.sum(weight * (values - matrix @ [now, rate]) ** 2))


def _steps(values: Floats, weight: Floats) -> Iterator[tuple[tuple[int, ...], float]]:
    """For no, one, two, ... jumps: first rows of the pieces of the best division, and its weighted sum of squared residuals."""
    n, values = len(values), values - np.average(values, weights=weight)
    w, wv, wvv = (np.concatenate(([0.0], np.cumsum(each))) for each in (weight, weight * values, weight * values**2))

    def squares(a: int, b: int) -> float:
        mass = w[b] - w[a]
        return float(max(wvv[b] - wvv[a] - (wv[b] - wv[a]) ** 2 / mass, 0.0))

    @cache
    def best(b: int, pieces: int) -> tuple[float, tuple[int, ...]]:
        """Least sum of squares of the first b values in so many pieces, and the first rows of these."""
        if pieces == 1:
            return squares(0, b), (0,)
        before = ((a, *best(a, pieces - 1)) for a in range(pieces - 1, b))
        return min((own + squares(a, b), (*starts, a)) for a, own, starts in before)

    for pieces in range(1, n + 1):
        left, starts = best(n, pieces)
        yield starts, left
