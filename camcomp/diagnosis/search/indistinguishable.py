"""Which causes can no analysis of these runs distinguish: computed from the model, the runs and the channels present.

Residuals are not used. The signature of one cause is compared with all signatures that another can have, with nuisances
and minor effects free: the sine of the angle between the two under the noise. Source: principal angles between
subspaces (Bjoerck and Golub, Mathematics of Computation 27, 1973).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from scipy.linalg import eigh

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.classes import LARGE
from camcomp.diagnosis.model.group import NormalEquations, sum_grams
from camcomp.diagnosis.statistics.evidence import FREE, Base, base

HIDDEN = 0.2  # difference of two effects at that size, in units of the noise, below which they are indistinguishable


@dataclass(frozen=True, eq=False)
class Likeness:
    """The design of an experiment: posterior of all columns within tolerance, and normal equations of the white rows."""

    problem: Problem
    within: Base
    data: NormalEquations

    def shows(self, i: int) -> bool:
        """Whether the candidate at `LARGE` times its scale moves the channels by their noise."""
        own = list(self.problem.candidates.columns[i])
        return LARGE**2 * float(np.diag(self.data.A)[own].sum()) > self.data.rows

    def apart(self, i: int, free: Sequence[int]) -> float:
        """Distance, in units of the noise, of candidate i at `LARGE` times the noise from the best fit of the candidates `free`.

        Of its parameters that direction counts which keeps least.
        """
        columns, d = self.problem.candidates.columns, len(self.problem.candidates.columns[i])
        index = [*columns[i], *(c for each in free for c in columns[each])]
        known = np.linalg.inv(self.within.covariance[np.ix_(index, index)]) - np.diag(self.within.precision[index])
        known[d:, d:] += FREE * np.eye(len(index) - d)
        left = known[:d, :d] - known[:d, d:] @ np.linalg.solve(known[d:, d:], known[d:, :d])
        own = self.data.A[np.ix_(index[:d], index[:d])]
        share = float(eigh(left, own + 1e-12 * np.trace(own) * np.eye(d), eigvals_only=True)[0])
        return LARGE * float(np.sqrt(max(share, 0.0)))

    def told(self, i: int) -> bool:
        """Whether the candidate shows, and nuisances leave something of it."""
        return self.shows(i) and self.apart(i, ()) >= HIDDEN


def likeness(problem: Problem) -> Likeness:
    """The design of a problem."""
    data = sum_grams(problem.base_grams)
    return Likeness(problem, base(data, problem.prior), data)


def classes(design: Likeness) -> list[tuple[int, ...]]:
    """Candidates that share a signature, in groups of two and more."""
    candidates = design.problem.candidates
    shown = [i for i in range(len(candidates.columns)) if design.told(i)]
    group = {i: {i} for i in shown}
    for i, j in permutations(shown, 2):
        if j not in group[i] and not candidates.exclusive(i, j) and design.apart(i, (j,)) < HIDDEN:
            both = group[i] | group[j]
            group.update(dict.fromkeys(both, both))
    return sorted({tuple(sorted(each)) for each in group.values() if len(each) > 1})
