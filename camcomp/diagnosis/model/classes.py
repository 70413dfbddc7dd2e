"""Identifiability: which sets these data cannot tell apart, by what their columns can do of one another.

The effect of the best set, d = A_S a_S with nuisances and small errors taken out, lies within the angle phi of the span
of another set; what stays of it, |d| sin(phi), is measured in noise: below INDISTINGUISHABLE the sets are one class.
"""

from __future__ import annotations

import numpy as np

from camcomp.diagnosis.model.evidence import Members, Reduced
from camcomp.diagnosis.model.explain import Explanation
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS
from camcomp.ground.datatypes import Floats

INDISTINGUISHABLE = 9.0  # chi-square of what another set leaves of the effect: three deviations
LARGE = 10.0  # size of an effect, in units of the noise, up to which an answer has to be right
HIDDEN = 0.2  # difference of two effects at that size, in units of the noise, below which they are indistinguishable
MOST_SETS = 4  # contract: alternatives that are listed


def alternatives_of(explanation: Explanation) -> list[Members]:
    """Sets nearly as probable as the best one, or that do the same, the best first; supersets of it are no alternatives."""
    data, best = explanation.data, explanation.members
    amount = data.estimate(best)[0] if best else np.zeros(0)
    top = max((p for m, _, p in explanation.sets if m == best), default=0.0)
    own = {data.candidates[i].place for i in best}
    out: list[Members] = [best]
    for members, places, p in explanation.sets:
        if places >= own:
            continue
        near = p >= top * np.exp(-EQUAL_LOG_ODDS)
        if not near and len(members) <= len(best) and p >= top * np.exp(-2.0 * EQUAL_LOG_ODDS):
            near = do_the_same(data, best, amount, members)
        if near:
            out.append(members)
    return out[:MOST_SETS]


def do_the_same(data: Reduced, best: Members, amount: Floats, other: Members) -> bool:
    """Whether the columns of another set leave less than three deviations of the effect of the best one at amplitudes (d,)."""
    on, by = data.indices(best), data.indices(other)
    left = float(amount @ data.gram[np.ix_(on, on)] @ amount)
    if by:
        toward = data.gram[np.ix_(by, on)] @ amount
        size = 1.0 / np.sqrt(np.maximum(np.diag(data.gram)[by], 1e-300))
        own = size[:, None] * data.gram[np.ix_(by, by)] * size
        left -= float((size * toward) @ np.linalg.lstsq(own, size * toward, rcond=1e-10)[0])
    return left < INDISTINGUISHABLE
