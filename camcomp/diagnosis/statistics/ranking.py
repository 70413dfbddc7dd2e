"""From sets of causes with probabilities to the best set, its alternatives and the probability of every cause."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.statistics.cause_sets import Fitted, Members
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS
from camcomp.ground.datatypes import Floats


@dataclass(frozen=True, eq=False)
class RankedSets:
    """Fitted sets that are answers with their probabilities (n,).

    first: index of the leading set. rivals: of those that explain the data as well, the most probable first. inclusion:
    probability of every candidate that any set has.
    """

    fits: tuple[Fitted, ...]
    probability: Floats
    first: int
    rivals: tuple[int, ...]
    inclusion: dict[int, float]

    @property
    def best(self) -> Fitted:
        """The leading set."""
        return self.fits[self.first]


def rank(fits: Sequence[Fitted], probability: Floats, twins: Sequence[tuple[Members, Members]]) -> RankedSets:
    """The ranking of fits by their probabilities; twins: pairs of sets that the data cannot tell apart.

    Twins of the best set and itself have equal parts of their common probability: neither a prior nor other sets break that tie.
    """
    order = np.argsort(-probability)
    best = int(order[0])
    leader = fits[best]
    rivals, twin = list[int](), [best]
    for j in order[1:] if leader.members else ():
        members = fits[j].members
        same = (leader.members, members) in twins or (members, leader.members) in twins
        near = np.log(max(probability[best], 1e-300) / max(probability[j], 1e-300)) < EQUAL_LOG_ODDS
        # a set with a superfluous member, or one too few, is no rival but the same answer less well put
        nested = set(members) >= set(leader.members) or set(members) <= set(leader.members)
        if (same or near) and not nested and len(members) <= len(leader.members):
            rivals.append(int(j))
            twin += [int(j)] if same else []
    held = probability.copy()
    held[twin] = held[twin].mean()
    inclusion: dict[int, float] = {}
    for fit, p in zip(fits, held, strict=True):
        for i in fit.members:
            inclusion[i] = inclusion.get(i, 0.0) + float(p)
    for i in leader.members:
        inclusion[i] = min(inclusion[i], sum(i in fits[j].members for j in twin) / len(twin))
    return RankedSets(tuple(fits), probability, best, tuple(rivals), inclusion)
