"""Which causes can no analysis of these runs distinguish: computed from the model, the runs and the channels present.

Residuals are not used. The signature of one cause is compared with all signatures that another can have, with nuisances
and minor effects free: the sine of the angle between the two under the noise. Source: principal angles between
subspaces (Bjoerck and Golub, Mathematics of Computation 27, 1973).
"""

from collections.abc import Sequence
from itertools import permutations

import numpy as np
from scipy.linalg import eigh

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.classes import HIDDEN, LARGE
from camcomp.diagnosis.statistics.evidence import FREE, posterior
from camcomp.diagnosis.statistics.normal_equations import sum_grams


def classes(problem: Problem) -> list[tuple[int, ...]]:
    """Candidates that share a signature, in groups of two and more."""
    data, candidates = sum_grams(problem.base_grams), problem.candidates
    columns, narrow = candidates.columns, problem.prior.precision
    covariance = posterior(data, problem.prior).across(np.arange(len(narrow)))

    def apart(i: int, free: Sequence[int]) -> float:
        """Distance, in units of the noise, of candidate i at `LARGE` times the noise from the best fit of the candidates `free`.

        Of its parameters that direction counts which keeps least.
        """
        index, d = [*columns[i], *(c for each in free for c in columns[each])], len(columns[i])
        known = np.linalg.inv(covariance[np.ix_(index, index)]) - np.diag(narrow[index])
        known[d:, d:] += FREE * np.eye(len(index) - d)
        left = known[:d, :d] - known[:d, d:] @ np.linalg.solve(known[d:, d:], known[d:, :d])
        own = data.A[np.ix_(index[:d], index[:d])]
        share = float(eigh(left, own + 1e-12 * np.trace(own) * np.eye(d), eigvals_only=True)[0])
        return LARGE * float(np.sqrt(max(share, 0.0)))

    # at LARGE times its scale it moves the channels by their noise, and nuisances leave something of it
    moves = [LARGE**2 * float(np.diag(data.A)[list(own)].sum()) > data.rows for own in columns]
    shown = [i for i, seen in enumerate(moves) if seen and apart(i, ()) >= HIDDEN]
    group = {i: {i} for i in shown}
    for i, j in permutations(shown, 2):
        if j not in group[i] and not candidates.exclusive(i, j) and apart(i, (j,)) < HIDDEN:
            both = group[i] | group[j]
            group.update(dict.fromkeys(both, both))
    return sorted({tuple(sorted(each)) for each in group.values() if len(each) > 1})
