"""Which causes can no analysis of these runs distinguish: computed from the model, the runs and the channels present.

Residuals are not used. The signature of one cause is compared with all signatures that another can have, with nuisances
and minor effects free: the sine of the angle between the two under the noise. Source: principal angles between
subspaces (Bjoerck and Golub, Mathematics of Computation 27, 1973).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations

import numpy as np
from scipy.linalg import eigh

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.statistics.cause_sets import Members, total
from camcomp.diagnosis.statistics.evidence import base
from camcomp.ground.datatypes import Floats

LARGE = 10.0  # size of an effect, in units of the noise, up to which an answer has to be right
HIDDEN = 0.2  # difference of two effects at that size, in units of the noise, below which they are indistinguishable
_SHOWS = 0.1  # size, in units of the noise, that a typical effect has to reach to be looked at at all


@dataclass(frozen=True, eq=False)
class Likeness:
    """The design of an experiment: covariance and precision (k, k), (k,) of all columns within tolerance, per kind of
    channel the Gram matrix (k, k) of its white rows and their number.
    """

    problem: Problem
    covariance: Floats
    precision: Floats
    grams: tuple[Floats, ...]
    rows: tuple[int, ...]

    def shows(self, i: int) -> bool:
        """Whether the candidate moves any channel."""
        return self._kinds[i][1] > _SHOWS

    def apart(self, i: int, free: Sequence[int], direction: Floats | None = None) -> float:
        """Distance, in units of the noise, of candidate i at `LARGE` times the noise from the best fit of the candidates `free`.

        direction (d,): of the parameters of i; that which keeps least when it is not given.
        """
        columns, d = self.problem.candidates.columns, len(self.problem.candidates.columns[i])
        index = [*columns[i], *(c for each in free for c in columns[each])]
        known = np.linalg.inv(self.covariance[np.ix_(index, index)]) - np.diag(self.precision[index])
        known[d:, d:] += np.diag(1.0 / (10.0 * self.problem.prior.scale[index[d:]]) ** 2)
        left = known[:d, :d] - known[:d, d:] @ np.linalg.solve(known[d:, d:], known[d:, :d])
        own = self.grams[self._kinds[i][0]][np.ix_(index[:d], index[:d])]
        if direction is None or d == 1:
            share = float(eigh(left, own + 1e-12 * np.trace(own) * np.eye(d), eigvals_only=True)[0])
        else:
            share = float(direction @ left @ direction) / max(float(direction @ own @ direction), 1e-300)
        return LARGE * float(np.sqrt(max(share, 0.0)))

    def told(self, i: int, free: Sequence[int] = (), direction: Floats | None = None) -> bool:
        """Whether the candidate shows, and nuisances and the candidates `free` leave something of it."""
        return self.shows(i) and self.apart(i, free, direction) >= HIDDEN

    @cached_property
    def _kinds(self) -> list[tuple[int, float]]:
        """Per candidate: the kind of channel in which one of its own scale shows best, and its rms there in units of the noise."""
        energy = np.array([np.diag(A) / max(n, 1) for A, n in zip(self.grams, self.rows, strict=True)])
        out = []
        for columns in self.problem.candidates.columns:
            size = np.sqrt(np.maximum(energy[:, list(columns)].sum(axis=1), 0.0))
            best = int(np.argmax(size))
            out.append((best, float(size[best])))
        return out


def likeness(problem: Problem) -> Likeness:
    """The design of a problem."""
    k = len(problem.columns.names)
    grams = [np.zeros((k, k)) for _ in problem.dictionaries]
    rows = [0] * len(grams)
    for white, parts in zip(problem.white, problem.white_patterns, strict=True):
        at = 0
        for n, part in enumerate(parts):
            block = white[at : at + len(part)]
            grams[n] += block.T @ block
            rows[n] += len(part)
            at += len(part)
    within = base(total(problem.base_grams), problem.prior, 1.0)
    return Likeness(problem, within.covariance, within.precision, tuple(grams), tuple(rows))


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


def stand_ins(design: Likeness, members: Members, theta: Floats) -> list[Members]:
    """Sets in which one member is replaced by a candidate that does the same in these runs; theta (d,): the members' coordinates."""
    candidates, at, found = design.problem.candidates, 0, list[Members]()
    told = [j for j in range(len(candidates.columns)) if j not in members and design.told(j)]
    for i in members:
        direction = theta[at : (at := at + len(candidates.columns[i]))]
        others = tuple(m for m in members if m != i)
        if not design.told(i, others, direction):
            continue  # another member does what it does
        free = [j for j in told if not any(candidates.exclusive(j, m) for m in members)]
        alike = [j for j in free if design.apart(i, (j, *others), direction) < HIDDEN]
        found += [tuple(sorted((*others, j))) for j in alike]
    return found
