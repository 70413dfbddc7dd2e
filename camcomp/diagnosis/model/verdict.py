"""The verdict from three calibrated probabilities: of something unmodelled, of the best set, and of its class."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from camcomp.diagnosis.statistics.probability import EVEN

SURE = 0.8  # probability from which on a set stands out

Word = Literal["none", "identified", "ambiguous", "unknown"]


@dataclass(frozen=True, kw_only=True)
class VerdictInputs:
    """Inputs of a verdict.

    unknown: probability of model discrepancy. best: probability that all causes of the best set act, with or without
    others; of the empty set, that the most probable cause is absent. alternatives: number of sets as good as it.
    causes: number of causes of the best set. known_noise: whether the floor is identifiable. confirmed: whether withheld
    groups support the set and are at their floor; None: all groups are fitted.
    """

    unknown: float
    best: float
    alternatives: int
    causes: int
    known_noise: bool
    confirmed: bool | None


def decide(s: VerdictInputs) -> Word:
    """The word of a result, before the noise floor is asked (result.floor_rule)."""
    if s.unknown > EVEN:
        return "unknown"
    if not s.known_noise:
        return "ambiguous"
    if not s.causes:
        return "none" if s.best >= SURE and s.confirmed is not False else "ambiguous"
    stands_out = s.best >= SURE and s.alternatives == 0 and s.unknown <= 1.0 - SURE
    return "identified" if stands_out and s.confirmed else "ambiguous"
