"""Which causes no analysis of these runs can tell apart: computed from the model, the runs and the channels present.

Nothing here looks at residuals. The signature of one cause is compared with all that another could do, with nuisances
and what every healthy machine has of everything allowed for: the sine of the angle between the two under the noise.
Source: principal angles between subspaces (Bjoerck and Golub, Mathematics of Computation 27, 1973).
"""

from collections.abc import Sequence
from dataclasses import dataclass

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
        return self._kind(i)[1] > _SHOWS

    def apart(self, i: int, j: int, free: Sequence[int] = (), direction: Floats | None = None) -> float:
        """What tells candidate i, `LARGE` times the noise, from the best candidate j can do beside the free candidates: in units of the noise.

        direction (d,): of the parameters of i; the most alike one when it is not given.
        """
        return self._beyond(i, (j, *free), direction)

    def alone(self, i: int) -> float:
        """The same without any other candidate: little where nuisances do the like, and then nothing else is its rival."""
        return self._beyond(i, (), None)

    def _beyond(self, i: int, free: Sequence[int], direction: Floats | None) -> float:
        columns = self.problem.candidates.columns
        mine, others = list(columns[i]), [c for each in free for c in columns[each]]
        index, d = [*mine, *others], len(mine)
        known = np.linalg.inv(self.covariance[np.ix_(index, index)]) - np.diag(self.precision[index])
        rest = known[d:, d:] + np.diag(1.0 / (10.0 * self.problem.prior.scale[others]) ** 2)
        left = known[:d, :d] - known[:d, d:] @ np.linalg.solve(rest, known[d:, :d])
        own = self.grams[self._kind(i)[0]][np.ix_(mine, mine)]
        if direction is not None and d > 1:
            whole = float(direction @ own @ direction)
            return LARGE * float(np.sqrt(max(float(direction @ left @ direction), 0.0) / whole)) if whole > 0 else 0.0
        half = np.linalg.cholesky(own + 1e-12 * np.trace(own) * np.eye(d))
        ratio = np.linalg.solve(half, np.linalg.solve(half, left).T)
        return LARGE * float(np.sqrt(max(float(np.linalg.eigvalsh(0.5 * (ratio + ratio.T))[0]), 0.0)))

    def _kind(self, i: int) -> tuple[int, float]:
        """The kind of channel in which an candidate of its own scale shows best, and its rms there in units of the noise."""
        columns = list(self.problem.candidates.columns[i])
        size = [
            np.sqrt(max(float(np.trace(A[np.ix_(columns, columns)])), 0.0) / max(n, 1))
            for A, n in zip(self.grams, self.rows, strict=True)
        ]
        best = int(np.argmax(size))
        return best, float(size[best])


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
    every = range(len(design.problem.columns.candidates))
    shown = [i for i in every if design.shows(i) and design.alone(i) >= HIDDEN]
    group = {i: {i} for i in shown}
    for i in shown:
        for j in shown:
            if j in group[i] or design.problem.candidates.exclusive(i, j) or design.apart(i, j) >= HIDDEN:
                continue
            both = group[i] | group[j]
            group.update(dict.fromkeys(both, both))
    return sorted({tuple(sorted(each)) for each in group.values() if len(each) > 1})


def stand_ins(design: Likeness, members: Members, theta: Floats) -> list[Members]:
    """Sets in which one member is replaced by an candidate that does the same in these runs; theta (d,): the members' coordinates."""
    candidates = design.problem.candidates
    told = [design.shows(j) and design.alone(j) >= HIDDEN for j in range(len(candidates.columns))]
    found: list[Members] = []
    at = 0
    for i in members:
        d = len(candidates.columns[i])
        direction = theta[at : at + d]
        at += d
        others = tuple(m for m in members if m != i)
        if not told[i]:
            continue
        for j in range(len(candidates.columns)):
            if (
                j in members
                or not told[j]
                or any(candidates.exclusive(j, m) for m in others)
                or candidates.exclusive(i, j)
            ):
                continue
            if design.apart(i, j, others, direction) < HIDDEN:
                found.append(tuple(sorted((*others, j))))
    return found
