"""Sets of causes that are fitted: which are tried, in which order, each through the twin.

The best-subset search of model/search ranks sets by the evidence linearised about a fit; the best of them are fitted, and
the search is repeated about the best fit until it is the same again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.candidates import PlacedCause
from camcomp.diagnosis.model.search import SLACK, search_sets
from camcomp.diagnosis.statistics.cause_sets import (
    Fitted,
    Members,
    Scale,
    scored,
)
from camcomp.diagnosis.statistics.evidence import estimate, log_bayes
from camcomp.diagnosis.statistics.normal_equations import sum_grams
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS
from camcomp.ground import progress
from camcomp.ground.datatypes import Floats

TRIED = 5  # sets fitted about a fit that are larger than it, as many of those that are not, and of single causes


@dataclass(frozen=True, eq=False)
class LinearSets:
    """Sets weighed by the evidence linearised about one fit, tolerances as stated; for model/search."""

    scale: Scale
    usable: Sequence[int]
    candidates: Sequence[PlacedCause]

    @cached_property
    def _equations(self) -> tuple[Floats, Floats]:
        """Normal equations of all columns' amplitudes, with all small errors integrated out."""
        return self.scale.at.blocks_without([np.arange(len(self.scale.at.mean))])[0]

    def value(self, members: Members) -> float:
        """Log evidence plus log prior."""
        scale = self.scale
        return scale.at.log_evidence + scale.worth([(i,) for i in members]) + scale.candidates.prior(members)

    def with_one_more(self, members: Members, more: Sequence[int]) -> Floats:
        """The same (m,) of a set with one of `more` each, the set's own amplitudes free; -inf where two exclude each other."""
        known = self.scale.candidates
        own, columns = [c for i in members for c in known.columns[i]], [known.columns[i] for i in more]
        gains, count = np.zeros(len(more)), np.array([len(each) for each in columns])
        for d in np.unique(count):
            at = np.flatnonzero(count == d)
            index = np.array([columns[i] for i in at.tolist()])
            gains[at] = log_bayes(self._equations, self.scale.prior.sign, index, np.zeros(d, int), own)
        gains += [known.prior(tuple(sorted((*members, i)))) for i in more]
        gains[[any(known.exclusive(i, j) for j in members) for i in more]] = -np.inf
        return np.asarray(gains + self.value(members) - known.prior(members), float)


class FittedSets:
    """The sets of causes of a problem that were fitted so far."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        seen = np.diag(sum_grams(problem.base_grams).A)
        self.every = [i for i, own in enumerate(problem.candidates.columns) if seen[list(own)].any()]
        self.null = problem.refit(())
        self.done: dict[Members, Fitted] = {(): self.null}
        self.searched = set[Members]()

    def fit(self, members: Members, near: Fitted | None = None) -> Fitted:
        """A set fitted through the twin, from the linear answer or from that of a fit near it; once each."""
        if members not in self.done:
            theta = None
            if near is not None:
                index = self.problem.member_columns(members)
                theta = estimate(near.data, self.problem.prior, index)[0][index]
            self.done[members] = self.problem.refit(members, theta)
            progress.done(len(self.done) / (3 * TRIED))
        return self.done[members]

    def search_near(self, near: Fitted) -> None:
        """Fit the best sets by the evidence linearised about a fit; about none, the best single causes, too."""
        self.searched.add(near.members)
        problem = self.problem
        scale = Scale(near.data, problem.prior, problem.candidates)
        named = zip(problem.columns.candidates, problem.candidates.columns, strict=True)
        places = [PlacedCause(c.name, c.target, own) for c, own in named]
        found = search_sets(LinearSets(scale, self.every, places))
        larger = {members for members in found if len(members) > len(near.members)}
        for some in (larger, found.keys() - larger - self.done.keys()):
            first = sorted(some, key=lambda members: (-found[members], members))[: 3 * TRIED]
            best = problem.candidates.value(near)
            for value, members in scored(scale, first)[:TRIED]:
                best = max(best, value)
                if value > best - SLACK:
                    self.fit(members, near)
        if not near.members:
            for _, members in scored(scale, [(i,) for i in self.every])[:TRIED]:
                self.fit(members)

    def answers(self, temperature: float = 1.0) -> list[Fitted]:
        """Sets without small members, the most probable first.

        A set with small members that is as likely as the best one gives its evidence to the set of its other members: a
        larger set would replace them otherwise.
        """

        def value(f: Fitted) -> float:
            return self.problem.candidates.value(f, temperature)

        found = {f.members: f for f in self.done.values() if not self.problem.small_members(f)}
        least = max(map(value, found.values())) - EQUAL_LOG_ODDS
        for f in [f for f in self.done.values() if value(f) > least and f.members not in found]:
            less = f
            while small := self.problem.small_members(less):
                less = self.fit(tuple(i for i in less.members if i not in small))
            minor = tuple(i for i in f.all_members if i not in less.members)
            more = replace(less, log_evidence=f.log_evidence, minor=minor)
            found[less.members] = max(found.get(less.members, less), more, key=value)
        return sorted(found.values(), key=value, reverse=True)
