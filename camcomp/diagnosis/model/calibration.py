"""The calibration map: from log odds of the posterior to a stated probability, and the inflation of intervals.

One monotone map per kind of log, fitted on simulated experiments by `python -m tests.validation calibrate` and stored with
its seeds in camcomp/data/calibration.json. Nothing else changes a probability.

Source: Platt, Advances in Large Margin Classifiers (1999).
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from camcomp.diagnosis.statistics.probability import PLACES


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
            p = float(np.interp(np.log(p / (1.0 - p)), self.log_odds, self.probability))
        return min(max(round(p, PLACES), 10.0**-PLACES), 1.0 - 10.0**-PLACES)


@cache
def calibration_of(kind: str) -> CalibrationMap:
    """The stored map of a kind of log: `poses`, `axes` or `programs`; no change where none is stored."""
    text = resources.files("camcomp.data").joinpath("calibration.json").read_text(encoding="utf-8")
    own = json.loads(text).get(kind)
    if own is None:
        return CalibrationMap()
    return CalibrationMap(tuple(own["log_odds"]), tuple(own["probability"]), own["interval"])
