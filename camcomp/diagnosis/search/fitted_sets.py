"""Sets of causes that are fitted: which are tried, in which order, each through the twin.

Steps: single causes, pairs, triples and larger sets from the best ones, effects at all of their targets, and exchanges of
members of the best sets until no exchange is better.
"""

from __future__ import annotations

from collections.abc import Sequence

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.statistics.cause_sets import (
    SIZES,
    Fitted,
    Members,
    Scale,
    exchanges,
    extensions,
    pairs,
    parted,
    total,
    with_minor,
)
from camcomp.diagnosis.statistics.evidence import estimate
from camcomp.diagnosis.statistics.stepwise import stepwise
from camcomp.diagnosis.statistics.verdict import EQUAL_LOG_ODDS
from camcomp.ground import progress

# sets that are tried of each size, and of those that begin with an effect at all of its targets
SINGLES, PAIRS, TRIPLES, KINDS = 6, 6, 3, 3
MORE = 3  # rounds in which one member is added to a set of three or more
EXCHANGES = 6  # rounds in which a member of the best sets is exchanged or left out
EXCHANGED = 4  # sets tried in each
EXCHANGEABLE = len(SIZES) - 2  # members up to which that is done
HOPELESS_LOG = 12.0  # log evidence behind the best at which a set is not fitted any more
LARGE_SCALES = 3.0  # size of an effect, in its typical ones, that would show at least if it can be seen at all
Ranked = list[tuple[float, Members, Fitted | None]]  # log posterior of sets, each with a fit to begin at


class FittedSets:
    """The sets of causes of a problem that were fitted so far."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.every = [i for i in range(len(problem.columns.candidates)) if is_visible(problem, i)]
        self.null = problem.refit(())
        self.at_null = Scale(total(self.null.grams), problem.prior, problem.candidates)
        self.done: dict[Members, Fitted] = {(): self.null}
        self._exchanged = set[Members]()

    def fit(self, members: Members, near: Fitted | None = None) -> Fitted:
        """A set fitted through the twin, from the linear answer or from that of a fit near it; once each."""
        if members not in self.done:
            theta = None
            if near is not None:
                index = self.problem.member_columns(members)
                theta = estimate(total(near.grams), self.problem.prior, index)[0][index]
            self.done[members] = self.problem.refit(members, theta)
            progress.done(len(self.done) / (SINGLES + PAIRS + TRIPLES))
        return self.done[members]

    def value(self, f: Fitted) -> float:
        """Log posterior of a fit up to a constant."""
        return self.problem.candidates.value(f)

    def scale(self, f: Fitted) -> Scale:
        """Evidence about a fit."""
        return Scale(total(f.grams), self.problem.prior, self.problem.candidates)

    def best(self, size: int | None = None) -> list[Fitted]:
        """The fits, or those of one size, the most probable first."""
        some = [f for f in self.done.values() if size is None or len(f.members) == size]
        return sorted(some, key=self.value, reverse=True)

    def search(self) -> None:
        """All steps."""
        self.fit_singles()
        self.fit_pairs()
        self.fit_triples()
        self.fit_larger_sets()
        self.fit_effects_everywhere()
        self.exchange_members()

    def fit_singles(self) -> None:
        """The best single causes, and the best one's effect at its other targets: the mistake to exclude first."""
        singles = extensions(self.at_null, (), self.every)
        for _, members in singles[:SINGLES]:
            self.fit(members)
        names = {self.problem.columns.candidates[i].name for i in singles[0][1]}
        for i in self.every:
            if self.problem.columns.candidates[i].name in names:
                self.fit((i,))

    def fit_pairs(self) -> None:
        """The best pairs by linear evidence, and the best extensions of single causes that were fitted."""
        found: Ranked = [(v, m, None) for v, m in pairs(self.at_null, self.every, PAIRS)]
        for f in self.best(1)[:3]:
            found += [(v, m, f) for v, m in extensions(self.scale(f), f.members, self.every)[:4]]
        self._fit_best(found, PAIRS, self.value(self.best()[0]))

    def fit_triples(self) -> None:
        """The best extensions of pairs."""
        found: Ranked = []
        for f in self.best(2)[:2]:
            found += [(v, m, f) for v, m in extensions(self.scale(f), f.members, self.every)[:3]]
        self._fit_best(found, TRIPLES, self.value(self.best()[0]))

    def fit_larger_sets(self) -> None:
        """One member more as long as that makes the best set better."""
        for _ in range(MORE):
            best = self.best()[0]
            if len(best.members) < 3:
                break
            self.fit(extensions(self.scale(best), best.members, self.every, EXCHANGED)[0][1], best)
            if self.best()[0] is best:
                break

    def fit_effects_everywhere(self) -> None:
        """Sets that stepwise selection leaves of an effect at all of its targets, for every effect that has several."""
        kinds = [tuple(i for i in kind if i in self.every) for kind in self.problem.candidates.kinds]
        left = {stepwise(self.at_null, kind, self.every, EXCHANGEABLE) for kind in kinds if 1 < len(kind) < len(SIZES)}
        prior, best = self.problem.candidates.prior, self.best()[0].members
        found: Ranked = [(self.at_null(each) + prior(each), each, None) for each in sorted(left)]
        self._fit_best(found, KINDS, self.at_null(best) + prior(best))

    def exchange_members(self) -> None:
        """Exchanges of members of the best answers: what was taken first may stand for what was found last."""
        for _ in range(EXCHANGES):
            answers = self.answers()
            least = self.value(answers[0]) - EQUAL_LOG_ODDS
            good = [self.done[f.all_members] for f in answers if self.value(f) > least]
            tied = [f for f in good if f.members not in self._exchanged]
            if not tied or len(good[0].members) > EXCHANGEABLE:
                break
            self.exchange(max(tied, key=self.value))

    def answers(self, temperature: float = 1.0) -> list[Fitted]:
        """Sets without small members, the most probable first.

        A set with small members that is as likely as the best one gives its evidence to the set of its other members: a
        larger set would take their place otherwise.
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

    def is_exchangeable(self, f: Fitted) -> bool:
        """Whether exchanges of members of a fit are still to be tried."""
        return bool(f.members) and f.members not in self._exchanged and len(f.members) <= EXCHANGEABLE

    def exchange(self, near: Fitted) -> None:
        """Fit the best sets that exchange one member of a fit, omit it, or replace it by two."""
        self._exchanged.add(near.members)
        scale = self.scale(near)
        others: Ranked = [
            (v, m, near) for v, m in exchanges(scale, near.members, self.every, EXCHANGED) if m not in self.done
        ]
        self._fit_best(others, EXCHANGED, self.value(near))
        if near.members and len(near.members) < EXCHANGEABLE:
            two = parted(scale, near.members, self.every, EXCHANGED)
            least = self.value(near) - EQUAL_LOG_ODDS
            good: Ranked = [(v, m, near) for v, m in two if v > least and m not in self.done]
            self._fit_best(good, EXCHANGED, self.value(near))

    def _fit_best(self, found: Sequence[tuple[float, Members, Fitted | None]], count: int, best: float) -> None:
        tried: set[Members] = set()
        for v, members, near in sorted(found, key=lambda each: -each[0]):
            if members in tried or v < best - HOPELESS_LOG or len(tried) >= count:
                continue
            tried.add(members)
            self.fit(members, near)


def is_visible(problem: Problem, i: int) -> bool:
    """Whether an effect of three scales would show at all in the channels present."""
    energy = sum(float((W[:, list(problem.candidates.columns[i])] ** 2).sum()) for W in problem.white)
    return energy * LARGE_SCALES**2 > 1.0
