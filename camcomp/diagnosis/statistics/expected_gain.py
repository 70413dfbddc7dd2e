"""How much information on the hypotheses is expected of an experiment? (Chaloner and Verdinelli, Statistical Science
10, 1995)
"""

from __future__ import annotations

import numpy as np

from camcomp.diagnosis.statistics.probability import SEED, TEMPERATURE
from camcomp.ground.datatypes import Floats

_OUTCOME_DRAWS = 64


def expected_gain(apart: Floats, probability: Floats) -> float:
    """Expected fall of the entropy, bits. apart (r, r): chi-square by which rival j misses the mean log of rival i."""
    rng = np.random.default_rng(SEED)
    after = 0.0
    for i, p in enumerate(probability):
        scatter = np.sqrt(apart[i]) * rng.standard_normal((_OUTCOME_DRAWS, len(probability)))
        logs = np.log(np.maximum(probability, 1e-12)) - (0.5 * apart[i] + scatter) / TEMPERATURE
        weight = np.exp(logs - logs.max(axis=1, keepdims=True))
        after += p * float(np.mean([_entropy(w / w.sum()) for w in weight]))
    return max(_entropy(probability) - float(after), 0.0)


def seen_apart(signals: Floats, left: Floats, hidden: float, large: float) -> float:
    """Chi-square of white rows `left` (w,) beyond the model error of signals (w, 2), for any number of rows.

    hidden: model error, in units of the noise, of signals `large` times the noise.
    """
    own = np.max(signals**2, axis=1) / large**2
    return max(float((left**2).sum()) - hidden**2 * (len(left) + float(own.sum())), 0.0)


def _entropy(p: Floats) -> float:
    p = p[p > 1e-12]
    return float(-(p * np.log2(p)).sum())
