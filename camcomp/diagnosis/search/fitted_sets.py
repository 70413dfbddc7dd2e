"""Sets of causes that are fitted: which are tried, in which order, each through the twin.

The best-subset search of model/search ranks sets by the evidence linearised about a fit; the best of them are fitted, and
the search is repeated about the best fit until it is the same again.
"""

from __future__ import annotations

from dataclasses import replace

from camcomp.diagnosis.fit.cause_sets import Fitted, Scale, scored
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.evidence import Members
from camcomp.diagnosis.model.search import SLACK, search_sets
from camcomp.diagnosis.statistics.evidence import estimate
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS
from camcomp.ground import progress

TRIED = 5  # sets fitted about a fit that are larger than it, as many of those that are not, and of single causes


class FittedSets:
    """The sets of causes of a problem that were fitted so far."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
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
        sets = scale.sets(range(len(problem.candidates.columns)))
        found = search_sets(sets)
        larger = {members for members in found if len(members) > len(near.members)}
        for some in (larger, found.keys() - larger - self.done.keys()):
            first = sorted(some, key=lambda members: (-found[members], members))[: 3 * TRIED]
            best = problem.candidates.value(near)
            for value, members in scored(scale, first)[:TRIED]:
                best = max(best, value)
                if value > best - SLACK:
                    self.fit(members, near)
        if not near.members:
            for _, members in scored(scale, [(i,) for i in sets.usable])[:TRIED]:
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
