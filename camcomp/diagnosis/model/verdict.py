"""The verdict from three calibrated probabilities: of something unmodelled, of the best set, and of its class."""

from __future__ import annotations

from typing import Literal

from camcomp.diagnosis.statistics.probability import EVEN

SURE = 0.8  # probability from which on a set stands out

Word = Literal["none", "identified", "ambiguous", "unknown"]


def decide(
    *,
    unknown: float,
    best: float,
    causes: int,
    alternatives: int = 0,
    known_noise: bool = True,
    confirmed: bool | None = True,
) -> Word:
    """The word of a result, before the noise floor is asked (result.floor_rule).

    Args:
        unknown: probability of model discrepancy.
        best: probability that all causes of the best set act, with or without others; of the empty set, that the most
            probable cause is absent.
        causes: number of causes of the best set.
        alternatives: number of sets as good as it.
        known_noise: whether the floor is identifiable.
        confirmed: whether withheld groups support the set and are at their floor; None: all groups are fitted.
    """
    if unknown > EVEN:
        return "unknown"
    if not known_noise:
        return "ambiguous"
    if not causes:
        return "none" if best >= SURE and confirmed is not False else "ambiguous"
    stands_out = best >= SURE and alternatives == 0 and unknown <= 1.0 - SURE
    return "identified" if stands_out and confirmed else "ambiguous"
