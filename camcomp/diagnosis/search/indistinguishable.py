"""Which causes can no analysis of these runs distinguish: computed from the model, the runs and the channels present.

Residuals are not used. The signature of one cause is compared with all signatures that another can have, with nuisances
and minor effects free: the sine of the angle between the two under the noise. Source: principal angles between
subspaces (Bjoerck and Golub, Mathematics of Computation 27, 1973).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.statistics.cause_sets import Members, total
from camcomp.diagnosis.statistics.evidence import base
from camcomp.ground.datatypes import Floats

LARGE = 10.0  # size of an effect, in units of the noise, up to which an answer has to be right
HIDDEN = 0.2  # what tells two apart at that size, in units of the noise, below which nobody should believe it
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

    def apart(self, i: int, others: Sequence[int], free: Sequence[int] = (), direction: Floats | None = None) -> Floats:
        """Distance, in units of the noise, of candidate i at `LARGE` times the noise from the best fit of each other
        one (j,) with the free candidates.

        direction (d,): of the parameters of i; the most alike one when it is not given.
        """
        columns = self.problem.candidates.columns
        mine, beside = list(columns[i]), [c for each in free for c in columns[each]]
        own = self.grams[self._kinds[i][0]][np.ix_(mine, mine)]
        d, out = len(mine), np.empty(len(others))
        counts = np.array([len(columns[j]) for j in others])
        for count in np.unique(counts):
            these = np.flatnonzero(counts == count)
            index = np.array([[*mine, *columns[others[int(n)]], *beside] for n in these])
            every = np.arange(index.shape[1])
            known = np.linalg.inv(self.covariance[index[:, :, None], index[:, None, :]])
            known[:, every, every] -= self.precision[index]
            known[:, every[d:], every[d:]] += 1.0 / (10.0 * self.problem.prior.scale[index[:, d:]]) ** 2
            left = known[:, :d, :d] - known[:, :d, d:] @ np.linalg.solve(known[:, d:, d:], known[:, d:, :d])
            out[these] = LARGE * np.sqrt(np.maximum(_share(left, own, direction), 0.0))
        return out

    def told(self, i: int, free: Sequence[int] = (), direction: Floats | None = None) -> bool:
        """Whether nuisances, and free candidates, leave something of the candidate: where they hide it, nothing else is its rival."""
        if not self.shows(i):
            return False
        columns = self.problem.candidates.columns
        mine, index = list(columns[i]), [*columns[i], *(c for each in free for c in columns[each])]
        d, wide = len(mine), self.problem.prior.scale[index[len(mine) :]]
        known = np.linalg.inv(self.covariance[np.ix_(index, index)]) - np.diag(self.precision[index])
        known[d:, d:] += np.diag(1.0 / (10.0 * wide) ** 2)
        left = known[:d, :d] - known[:d, d:] @ np.linalg.solve(known[d:, d:], known[d:, :d])
        own = self.grams[self._kinds[i][0]][np.ix_(mine, mine)]
        return bool(LARGE * np.sqrt(max(float(_share(np.asarray(left[None]), own, direction)[0]), 0.0)) >= HIDDEN)

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


def _share(left: Floats, own: Floats, direction: Floats | None) -> Floats:
    """Share (n,) of the energy own (d, d) that remains as `left` (n, d, d), in a direction (d,) or in the direction
    that keeps least.
    """
    d = len(own)
    if direction is not None and d > 1:
        whole = float(direction @ own @ direction)
        return np.asarray(
            np.einsum("d,nde,e->n", direction, left, direction) / whole if whole > 0 else np.zeros(len(left))
        )
    half = np.linalg.cholesky(own + 1e-12 * np.trace(own) * np.eye(d))
    ratio = np.linalg.solve(half, np.swapaxes(np.linalg.solve(half, left), 1, 2))
    return np.asarray(np.linalg.eigvalsh(0.5 * (ratio + np.swapaxes(ratio, 1, 2)))[:, 0])


def likeness(problem: Problem) -> Likeness:
    """The design of an problem."""
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
    """Atoms that share a signature, in groups of two and more."""
    candidates = design.problem.candidates
    shown = [i for i in range(len(candidates.columns)) if design.told(i)]
    group = {i: {i} for i in shown}
    for i in shown:
        others = [j for j in shown if j != i and not candidates.exclusive(i, j)]
        for j, apart in zip(others, design.apart(i, others), strict=True):
            if apart < HIDDEN and j not in group[i]:
                both = group[i] | group[j]
                group.update(dict.fromkeys(both, both))
    return sorted({tuple(sorted(each)) for each in group.values() if len(each) > 1})


def stand_ins(design: Likeness, members: Members, theta: Floats) -> list[Members]:
    """Sets in which one member is replaced by an candidate that does the same in these runs; theta (d,): the members' coordinates."""
    candidates = design.problem.candidates
    told = [design.told(j) for j in range(len(candidates.columns))]
    found: list[Members] = []
    at = 0
    for i in members:
        d = len(candidates.columns[i])
        direction = theta[at : at + d]
        at += d
        others = tuple(m for m in members if m != i)
        if not design.told(i, others, direction):
            continue  # another member does what it does: beside that one nothing is its rival
        free = [
            j
            for j in range(len(candidates.columns))
            if j not in members
            and told[j]
            and not any(candidates.exclusive(j, m) for m in others)
            and not candidates.exclusive(i, j)
        ]
        apart = design.apart(i, free, others, direction)
        found += [tuple(sorted((*others, j))) for j, much in zip(free, apart, strict=True) if much < HIDDEN]
    return found
