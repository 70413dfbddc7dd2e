"""Course of a parameter over the days: steady, drift or jumps, and the day of its next measurement.

Estimates of n days with known deviations are described by one value, a straight line, or values that change at up to
MOST_JUMPS days. The Bayesian information criterion chooses (Schwarz 1978); a jump counts its day as a parameter (Yao 1988).
Least squares over all divisions by dynamic programming (Jackson et al. 2005).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from camcomp.ground.datatypes import Floats

MOST_JUMPS = 3
FEWEST = 4  # measurements needed for a line or a jump
_MARGIN = 4.0  # least difference of the criterion for a richer description: odds of 7 to 1


@dataclass(frozen=True, kw_only=True)
class Course:
    """Course of a value.

    rate, rate_sd: per day (drift); jumps: rows at which it changed; level, level_sd: present value; spread: scatter about the
    description in units of the stated deviations.
    """

    kind: Literal["steady", "drift", "jumps", "too few"]
    level: float
    level_sd: float
    rate: float
    rate_sd: float
    jumps: tuple[int, ...]
    spread: float


def course_of(days: Floats, values: Floats, deviations: Floats) -> Course:
    """The course of values (n,) with standard deviations (n,) measured at days (n,), in order of the days."""
    n = len(days)
    weight = 1.0 / np.maximum(deviations, 1e-300) ** 2
    mean, misfit = _constant(values, weight)
    if n < FEWEST:
        return Course(
            kind="too few", level=mean, level_sd=float(weight.sum() ** -0.5), rate=0.0, rate_sd=0.0, jumps=(),
            spread=_spread(misfit, n - 1),
        )  # fmt: skip
    line = _line(days, values, weight)
    cost: list[tuple[float, Course]] = [
        (
            misfit + np.log(n),
            Course(
                kind="steady",
                level=mean,
                level_sd=float(weight.sum() ** -0.5),
                rate=0.0,
                rate_sd=0.0,
                jumps=(),
                spread=_spread(misfit, n - 1),
            ),
        )
    ]
    now, now_sd, rate, rate_sd, left = line
    cost.append(
        (
            left + 2 * np.log(n) + _MARGIN,
            Course(
                kind="drift",
                level=now,
                level_sd=now_sd,
                rate=rate,
                rate_sd=rate_sd,
                jumps=(),
                spread=_spread(left, n - 2),
            ),
        )
    )
    for count, (starts, left) in enumerate(_steps(values, weight), 1):
        last = slice(starts[-1], n)
        level, _ = _constant(values[last], weight[last])
        own = Course(
            kind="jumps", level=level, level_sd=float(weight[last].sum() ** -0.5), rate=0.0, rate_sd=0.0,
            jumps=tuple(starts[1:]), spread=_spread(left, n - 1 - 2 * count),
        )  # fmt: skip
        cost.append((left + (1 + 2 * count) * np.log(n) + _MARGIN * count, own))
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
    weight = 1.0 / np.maximum(deviations, 1e-300) ** 2
    centred = days - np.average(days, weights=weight)
    spread = float(np.sum(weight * centred**2))
    return spread**-0.5 if spread > 0.0 else 0.0


def _constant(values: Floats, weight: Floats) -> tuple[float, float]:
    mean = float(np.average(values, weights=weight))
    return mean, float(np.sum(weight * (values - mean) ** 2))


def _line(days: Floats, values: Floats, weight: Floats) -> tuple[float, float, float, float, float]:
    """Value at the last day with its deviation, rate with its deviation, weighted sum of squared residuals."""
    since = days - days[-1]
    matrix = np.column_stack((np.ones(len(days)), since))
    normal = matrix.T @ (weight[:, None] * matrix)
    covariance = np.linalg.pinv(normal)
    now, rate = covariance @ (matrix.T @ (weight * values))
    left = float(np.sum(weight * (values - matrix @ [now, rate]) ** 2))
    return float(now), float(np.sqrt(covariance[0, 0])), float(rate), float(np.sqrt(covariance[1, 1])), left


def _steps(values: Floats, weight: Floats) -> list[tuple[list[int], float]]:
    """For one, two, ... jumps: first rows of the pieces of the best division, and its weighted sum of squared residuals."""
    n = len(values)
    w, wv, wvv = (np.concatenate(([0.0], np.cumsum(each))) for each in (weight, weight * values, weight * values**2))

    def squares(a: int, b: int) -> float:
        mass = w[b] - w[a]
        return float(max(wvv[b] - wvv[a] - (wv[b] - wv[a]) ** 2 / mass, 0.0))

    best = [[squares(0, b) if b else 0.0 for b in range(n + 1)]]
    start = [[0] * (n + 1)]
    out = []
    for count in range(1, min(MOST_JUMPS, n - 1) + 1):
        row, origin = [np.inf] * (n + 1), [0] * (n + 1)
        for b in range(count + 1, n + 1):
            choices = [best[-1][a] + squares(a, b) for a in range(count, b)]
            k = int(np.argmin(choices))
            row[b], origin[b] = choices[k], count + k
        best.append(row)
        start.append(origin)
        pieces, b = [n], n
        for level in range(count, 0, -1):
            b = start[level][b]
            pieces.append(b)
        out.append(([0, *reversed(pieces[1:])], row[n]))
    return out


def _spread(misfit: float, free: int) -> float:
    return float(np.sqrt(misfit / free)) if free > 0 else 1.0
