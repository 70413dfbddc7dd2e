"""How probable is a set of causes, by the evidence linearised about one fit?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.model.candidates import PlacedCause
from camcomp.diagnosis.statistics.cause_sets import Members, Scale
from camcomp.diagnosis.statistics.evidence import freed, log_bayes
from camcomp.ground.datatypes import Floats


@dataclass(frozen=True, eq=False)
class LinearSets:
    """Sets weighed by the evidence linearised about one fit, tolerances as stated; for model/search."""

    scale: Scale
    usable: Sequence[int]
    candidates: Sequence[PlacedCause]

    def value(self, members: Members) -> float:
        """Log evidence plus log prior."""
        at, columns = self.scale.at_stated, self.scale.candidates.columns
        causes = [columns[i] for i in members]
        more = float(log_bayes([at], self.scale.prior, [causes])[0, 0]) if causes else 0.0
        return at.log_evidence + more + self.scale.candidates.prior(members)

    def with_one_more(self, members: Members, more: Sequence[int]) -> Floats:
        """The same (m,) of a set with one of `more` each, the set's own amplitudes free; -inf where two exclude each other."""
        scale, known = self.scale, self.scale.candidates
        own = [c for i in members for c in known.columns[i]]
        at = freed(scale.at_stated, scale.prior, own) if own else scale.at_stated
        gains = log_bayes([at], scale.prior, [[known.columns[i]] for i in more])[0]
        gains += [known.prior(tuple(sorted((*members, i)))) for i in more]
        gains[[any(known.exclusive(i, j) for j in members) for i in more]] = -np.inf
        return np.asarray(gains + self.value(members) - known.prior(members), float)
