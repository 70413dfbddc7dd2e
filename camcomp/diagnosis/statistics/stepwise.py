"""Stepwise selection: sets of causes that no single step from the best small sets would reach.

A machine is wrong in several things at once as often as not, in all of its springs and in the force, and one cause at a
time ends where two others stand for three of them. A selection that begins with an effect at all of its targets, and lets
go what is not needed, comes from the other side.
"""

from collections.abc import Sequence

import numpy as np

from camcomp.diagnosis.statistics.cause_sets import CausePrior, Members, Scale
from camcomp.diagnosis.statistics.evidence import TOLERANCES, Base, Prior, freed, log_bayes
from camcomp.ground.datatypes import Floats


def stepwise(scale: Scale, start: Members, candidates: Sequence[int], most: int) -> Members:
    """The set from which no candidate's coming or going gains anything any more: at most `most` members, tolerances as stated.

    A step takes the candidate whose coming or going gains most while the other members are free.
    """
    at, prior, known = scale.bases[TOLERANCES.index(1.0)], scale.prior, scale.candidates
    members, seen = tuple(sorted(start)), set[Members]()
    while members not in seen:  # steps are judged beside different others, and might go round
        seen.add(members)
        rest = [tuple(x for x in members if x != i) for i in members]
        losses = [_gains(at, prior, known, less, [i])[0] for less, i in zip(rest, members, strict=True)]
        least = int(np.argmin(losses)) if losses else -1
        free = [i for i in candidates if i not in members and not any(known.exclusive(i, j) for j in members)]
        gains = _gains(at, prior, known, members, free) if free and len(members) < most else np.full(1, -np.inf)
        if len(members) > most or (losses and losses[least] < min(0.0, -gains.max())):
            members = rest[least]
        elif gains.max() > 0.0:
            members = tuple(sorted((*members, free[int(gains.argmax())])))
    return members


def _gains(at: Base, prior: Prior, known: CausePrior, members: Members, more: Sequence[int]) -> Floats:
    """Log Bayes factor and log prior odds (m,) of one more member each, all of `members` free."""
    columns = [known.columns[i] for i in more]
    beside = freed(at, prior, [c for i in members for c in known.columns[i]]) if members else at
    odds = np.array([known.prior(tuple(sorted((*members, i)))) for i in more]) - known.prior(members)
    return np.asarray(odds + log_bayes([beside], prior, [[each] for each in columns])[0])
