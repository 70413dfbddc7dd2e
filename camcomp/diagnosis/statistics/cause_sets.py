"""Searching the sets of up to three causes: all sets that look good linearly, re-fitted through the twin, then ranked.

The search knows grams, priors and numbers of candidates; what an candidate is, and how it is re-fitted, its caller says.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from math import factorial, log

import numpy as np
from scipy.special import logsumexp

from camcomp.diagnosis.statistics.evidence import (
    Prior,
    base,
    holding_back,
    log_bayes,
    misfit,
)
from camcomp.diagnosis.statistics.normal_equations import NormalEquations, sum_grams
from camcomp.diagnosis.statistics.probability import TEMPERATURE
from camcomp.ground.datatypes import Floats

Members = tuple[int, ...]
ALL_PARTS = 3  # members up to which every part of a set is looked at; of larger ones all but one, each alone, and none
SIZES = (0.45, 0.33, 0.13, 0.055, 0.022, 0.009, 0.004)  # prior probability of 0, 1, 2 ... causes


@dataclass(frozen=True, eq=False, kw_only=True)
class Fitted:
    """A set of causes with the evidence for it. theta (d,): coordinates of its columns in units of their scales."""

    members: Members
    theta: Floats
    covariance: Floats
    log_evidence: float
    grams: tuple[NormalEquations, ...]  # per run, about the fit, in absolute coordinates
    extra: Mapping[int, Mapping[str, float]] = field(default_factory=dict)  # scanned shapes by candidate
    white: tuple[Floats, ...] = ()  # per run (w, d), the members' columns at the fit
    residual: tuple[Floats, ...] = ()  # per run (w,), in absolute coordinates
    # (k,) how many times as far as at nominal every column bends the machine of the members
    farther: Floats = field(default_factory=lambda: np.ones(1))
    minor: Members = ()  # minor causes in the evidence that are not reported

    @property
    def all_members(self) -> Members:
        """The members and the minor effects fitted with them, to which the evidence belongs."""
        return tuple(sorted((*self.members, *self.minor)))

    @cached_property
    def data(self) -> NormalEquations:
        """Of all runs."""
        return sum_grams(self.grams)

    def without(self, k: int) -> NormalEquations:
        """Of all runs but one."""
        return sum_grams([*self.grams[:k], *self.grams[k + 1 :]])


@dataclass(frozen=True, eq=False)
class CausePrior:
    """Columns of every candidate, and the log prior weight of each as a member."""

    columns: tuple[tuple[int, ...], ...]
    weight: Floats
    exclusive: Callable[[int, int], bool]  # whether two candidates make no sense together

    def prior(self, members: Members, minor: Members = ()) -> float:
        """Log prior probability of a set with its minor effects, drawn one after the other in any order."""
        every = (*members, *minor)
        return log(SIZES[len(every)] * factorial(len(every))) + sum(float(self.weight[i]) for i in every)

    def value(self, f: Fitted, temperature: float = 1.0) -> float:
        """Tempered log evidence of a set with its minor effects, plus their log prior."""
        return f.log_evidence / temperature + self.prior(f.members, f.minor)


def parts_of(members: Members) -> list[Members]:
    """The set itself and sets of some of its members: of up to ALL_PARTS every one, else all but one, each alone, and none."""
    n = len(members)
    sizes = range(n, -1, -1) if n <= ALL_PARTS else (n, n - 1, 1, 0)
    return [each for size in sizes for each in combinations(members, size)]


def temperature_of(f: Fitted, prior: Prior, index: Sequence[int]) -> float:
    """What log evidence is divided by where a set with columns `index` is the best: no model is as good as its noise, and
    one that leaves more than noise is worth less by as much (quasi-likelihood).
    """
    return TEMPERATURE * max(1.0, misfit(f.data, prior, index) / max(f.data.rows, 1))


class Scale:
    """Evidence of sets of candidates for one gram; base: the posterior of no cause."""

    def __init__(self, data: NormalEquations, prior: Prior, candidates: CausePrior) -> None:
        self.prior, self.candidates = prior, candidates
        self.base = base(data, prior)

    def __call__(self, members: Members) -> float:
        """Log evidence of a set."""
        causes = [self.candidates.columns[i] for i in members]
        none = self.base.log_evidence - holding_back(self.base, self.prior, [c for own in causes for c in own])
        return none + float(log_bayes(self.base, self.prior, [causes])[0])


def scored(scale: Scale, sets: Iterable[Members]) -> list[tuple[float, Members]]:
    """Log evidence + log prior of sets, best first."""
    return sorted(((scale(each) + scale.candidates.prior(each), each) for each in sets), reverse=True)


def probabilities(fits: Sequence[Fitted], candidates: CausePrior, temperature: float = 1.0) -> Floats:
    """Posterior probability of every set among those fitted."""
    value = np.array([candidates.value(f, temperature) for f in fits])
    return np.asarray(np.exp(value - logsumexp(value)))
