"""Sets of causes that are fitted: which are tried, in which order, each through the twin.

The best-subset search of model/search ranks sets by the evidence linearised about a fit; the best of them are fitted, and
the search is repeated about the best fit until it is the same again.
"""

from __future__ import annotations

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.model.candidates import PlacedCause
from camcomp.diagnosis.model.search import search_sets
from camcomp.diagnosis.search.linear_sets import LinearSets
from camcomp.diagnosis.statistics.cause_sets import (
    Fitted,
    Members,
    Scale,
    scored,
    total,
    with_minor,
)
from camcomp.diagnosis.statistics.evidence import estimate
from camcomp.diagnosis.statistics.verdict import EQUAL_LOG_ODDS
from camcomp.ground import progress

SINGLES = 6  # single causes that are fitted in any case
TRIED = 5  # sets fitted about a fit that are larger than it, and as many of those that are not
ROUNDS = 6  # fits about which sets are searched
HOPELESS_LOG = 12.0  # log evidence behind the best at which a set is not fitted any more
LARGE_SCALES = 3.0  # size of an effect, in its typical ones, that would show at least if it can be seen at all


class FittedSets:
    """The sets of causes of a problem that were fitted so far."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.every = [i for i in range(len(problem.columns.candidates)) if is_visible(problem, i)]
        self.null = problem.refit(())
        self.done: dict[Members, Fitted] = {(): self.null}
        self.searched = set[Members]()

    def fit(self, members: Members, near: Fitted | None = None) -> Fitted:
        """A set fitted through the twin, from the linear answer or from that of a fit near it; once each."""
        if members not in self.done:
            theta = None
            if near is not None:
                index = self.problem.member_columns(members)
                theta = estimate(total(near.grams), self.problem.prior, index)[0][index]
            self.done[members] = self.problem.refit(members, theta)
            progress.done(len(self.done) / (SINGLES + 2 * TRIED))
        return self.done[members]

    def value(self, f: Fitted) -> float:
        """Log posterior of a fit up to a constant."""
        return self.problem.candidates.value(f)

    def search_near(self, near: Fitted) -> None:
        """Fit the best sets by the evidence linearised about a fit; about none, the best single causes, too."""
        self.searched.add(near.members)
        problem = self.problem
        scale = Scale(total(near.grams), problem.prior, problem.candidates)
        named = zip(problem.columns.candidates, problem.candidates.columns, strict=True)
        places = [PlacedCause(c.name, c.target, own) for c, own in named]
        found = search_sets(LinearSets(scale, self.every, places)).values
        larger = {members for members in found if len(members) > len(near.members)}
        for some in (larger, found.keys() - larger - self.done.keys()):
            first = sorted(some, key=lambda members: (-found[members], members))[: 3 * TRIED]
            best = self.value(near)
            for value, members in scored(scale, first)[:TRIED]:
                best = max(best, value)
                if value > best - HOPELESS_LOG:
                    self.fit(members, near)
        if not near.members:
            for _, members in scored(scale, [(i,) for i in self.every])[:SINGLES]:
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
            found[less.members] = max(found.get(less.members, less), with_minor(less, f), key=value)
        return sorted(found.values(), key=value, reverse=True)


def is_visible(problem: Problem, i: int) -> bool:
    """Whether an effect of three scales would show at all in the channels present."""
    energy = sum(float((W[:, list(problem.candidates.columns[i])] ** 2).sum()) for W in problem.white)
    return energy * LARGE_SCALES**2 > 1.0
