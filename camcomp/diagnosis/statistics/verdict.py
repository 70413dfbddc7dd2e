"""From ranked sets of causes to a verdict: none, identified, ambiguous or unknown."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.statistics.cause_sets import CausePrior, Fitted, Members
from camcomp.diagnosis.statistics.probability import EVEN, UNSURE
from camcomp.ground.datatypes import Floats

EQUAL_LOG_ODDS = 3.0  # log odds within which two sets are told apart by nobody
BARE_ODDS = 3.0  # of the leader against a set that does nearly the same: not worth a mention


@dataclass(frozen=True, eq=False)
class Verdict:
    """word: none | identified | ambiguous | unknown. best: index of the leading set. rivals: indices of sets that explain
    the data alike. inclusion: probability of every candidate that any fitted set has.
    """

    word: str
    best: int
    rivals: tuple[int, ...]
    inclusion: dict[int, float]


def judge(
    fits: Sequence[Fitted], probability: Floats, twins: Sequence[tuple[Members, Members]], candidates: CausePrior
) -> Verdict:
    """Fits with their probabilities, and what these were before the data; twins: pairs of sets that the data cannot tell
    apart whatever their prior.
    """
    order = np.argsort(-probability)
    best = int(order[0])
    leader = fits[best]
    rivals, twin = [], [best]
    for j in order[1:] if leader.members else ():
        fit = fits[j]
        same = (leader.members, fit.members) in twins or (fit.members, leader.members) in twins
        alike = same or np.log(max(probability[best], 1e-300) / max(probability[j], 1e-300)) < EQUAL_LOG_ODDS
        # A set with a superfluous member, or one too few, is no rival but the same answer less well put.
        nested = set(fit.members) >= set(leader.members) or set(fit.members) <= set(leader.members)
        if alike and not nested and len(fit.members) <= len(leader.members):
            rivals.append(int(j))
            twin += [int(j)] if same else []
    # among what the data hardly tell apart a small lead is none, and priors alone put nothing further behind than nobody would
    held = probability.copy()
    near = BARE_ODDS * held[twin] > held[best]
    held[twin] = np.where(near, held[best], np.maximum(held[twin], held[best] * np.exp(-EQUAL_LOG_ODDS)))
    least = (1.0 - UNSURE) / UNSURE * held[best]
    if 0.0 < (others := held[twin[1:]].sum()) < least:  # what is ambiguous is not sure
        held[twin[1:]] *= least / others
    held[twin] *= probability[twin].sum() / held[twin].sum()
    inclusion: dict[int, float] = {}
    for fit, p in zip(fits, held, strict=True):
        for i in fit.members:
            inclusion[i] = inclusion.get(i, 0.0) + float(p)
    tied = [fits[j].members for j, level in zip(twin, near, strict=True) if level]
    for i in leader.members:  # sets of another kind break no tie, nor do twins further behind
        having = sum(float(held[j]) for j in twin if i in fits[j].members) / float(held[twin].sum())
        inclusion[i] = min(inclusion[i], having, sum(i in members for members in tied) / len(tied))
    seen = np.log(np.maximum(probability, 1e-300)) - [candidates.prior(f.members, f.minor) for f in fits]
    for j in twin:  # and what leads by its prior alone is no more likely than not
        if seen[best] - seen[j] < np.log(BARE_ODDS):
            inclusion |= {i: min(inclusion[i], EVEN) for i in leader.members if i not in fits[j].members}
    word = "none" if not leader.members else "ambiguous" if rivals else "identified"
    return Verdict(word, best, tuple(rivals), inclusion)
