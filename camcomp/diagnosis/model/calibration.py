"""The calibration map: from log odds of the posterior to a stated probability, and the inflation of intervals.

One monotone map per kind of log, fitted on simulated experiments by `python -m tests.validation calibrate` and stored with
its seeds in camcomp/data/calibration.json. Nothing else changes a probability.

Source: Platt, Advances in Large Margin Classifiers (1999); isotonic regression, Zadrozny, Elkan, KDD 2002.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from camcomp.diagnosis.statistics.probability import PLACES
from camcomp.ground.datatypes import Floats

MOST_LOG_ODDS = 20.0  # beyond it a posterior is as good as certain
LEAST_PER_LEVEL = 20  # causes of one level of the map: a rate known to a tenth
BELOW = 8  # log odds: knots of the map where no experiment was, one each


@dataclass(frozen=True)
class CalibrationMap:
    """Knots of log odds with the probability that goes with each, and the factor on half widths of intervals."""

    log_odds: tuple[float, ...] = ()
    probability: tuple[float, ...] = ()
    interval: float = 1.0

    def calibrate(self, probability: float) -> float:
        """The probability that is stated for one of the posterior, in between 0 and 1, both excluded."""
        p = min(max(probability, 1e-12), 1.0 - 1e-12)
        if self.log_odds:
            odds = float(np.clip(np.log(p / (1.0 - p)), -MOST_LOG_ODDS, MOST_LOG_ODDS))
            p = float(np.interp(odds, self.log_odds, self.probability))
        return min(max(round(p, PLACES), 10.0**-PLACES), 1.0 - 10.0**-PLACES)


@cache
def calibration_of(kind: str) -> CalibrationMap:
    """The stored map of a kind of log: `poses`, `axes` or `programs`; no change where none is stored."""
    text = resources.files("camcomp.data").joinpath("calibration.json").read_text(encoding="utf-8")
    own = json.loads(text).get(kind)
    if own is None:
        return CalibrationMap()
    return CalibrationMap(tuple(own["log_odds"]), tuple(own["probability"]), own["interval"])


def fit_map(probability: Sequence[float], right: Sequence[bool], misses: Sequence[float]) -> CalibrationMap:
    """The map that makes stated probabilities come true: pool adjacent violators, levels of LEAST_PER_LEVEL and more.

    misses: |value - truth| in half widths of 95 % intervals, of parameters that were named; their 95 % quantile is the
    factor on half widths.
    """
    p = np.clip(np.array(probability, float), 1e-12, 1.0 - 1e-12)
    odds = np.clip(np.log(p / (1.0 - p)), -MOST_LOG_ODDS, MOST_LOG_ODDS)
    order = np.argsort(odds, kind="stable")
    levels = [[odds[i], float(right[i]), 1.0] for i in order]
    pooled: list[list[float]] = []
    for level in levels:
        pooled.append(level)
        while len(pooled) > 1 and (
            pooled[-2][1] / pooled[-2][2] >= pooled[-1][1] / pooled[-1][2] or pooled[-2][2] < LEAST_PER_LEVEL
        ):
            last = pooled.pop()
            own = pooled[-1]
            weight = own[2] + last[2]
            pooled[-1] = [(own[0] * own[2] + last[0] * last[2]) / weight, own[1] + last[1], weight]
    knots = np.array([[o, (r + 0.5) / (n + 1.0)] for o, r, n in pooled])
    if knots[0, 0] > 0.0:  # below even odds nothing was seen: the posterior as it is, below the first level
        odds = np.linspace(-BELOW, 0.0, BELOW + 1)
        knots = np.vstack([np.column_stack([odds, 2.0 * min(knots[0, 1], 0.5) / (1.0 + np.exp(-odds))]), knots])
    factor = max(float(np.quantile(misses, 0.95)), 1.0) if len(misses) >= LEAST_PER_LEVEL else 1.0
    return CalibrationMap(tuple(knots[:, 0].tolist()), tuple(_rising(knots[:, 1]).tolist()), round(factor, 3))


def _rising(values: Floats) -> Floats:
    """Values (n,) that never fall."""
    return np.asarray(np.maximum.accumulate(values), float)
