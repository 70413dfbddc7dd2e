"""Sets of causes of programs: priors of columns and of sets, their evidence by model/evidence, and what a fit of a set holds.

Columns belong to effects, to nuisances and to what every healthy machine has. An effect that is no cause has the narrow prior
of its tolerance: a machine is never exactly its model, and what is within tolerance is no finding.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from math import comb, factorial, log

import numpy as np
from scipy.special import logsumexp

from camcomp.diagnosis.model.candidates import AmplitudeBounds, PlacedCause
from camcomp.diagnosis.model.evidence import SIZES, AmplitudePosterior, Members, Reduced
from camcomp.diagnosis.statistics.normal_equations import NormalEquations, sum_grams
from camcomp.diagnosis.statistics.probability import EVEN, TEMPERATURE
from camcomp.ground.datatypes import Floats

PATTERN = 3  # targets of one effect from which on they may have one origin: springs of several joints are one thing that gives way
ALL_PARTS = 3  # members up to which every part of a set is looked at; of larger ones all but one, each alone, and none
FREE = 0.01  # precision of a cause while it is fitted: within 10 scales


@dataclass(frozen=True, eq=False)
class Prior:
    """For every column (k,), in units of its typical size: tolerance = narrow size (inf = free nuisance), sign, and unit = amplitude
    by which it moves the tip by one floor.
    """

    tolerance: Floats
    sign: Floats
    unit: Floats

    @property
    def precision(self) -> Floats:
        """Narrow precision (k,)."""
        return np.where(np.isinf(self.tolerance), 1e-12, 1.0 / np.maximum(self.tolerance, 1e-15) ** 2)

    def precision_beside(self, members: Sequence[int]) -> Floats:
        """Precision (k,) with the columns `members` free within 10 scales, the others within tolerance."""
        precision = self.precision
        precision[list(members)] = FREE
        return precision


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
    farther: Floats | None = (
        None  # (k,) how many times as far as at nominal every column bends the machine of the members
    )
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
    """Prior of sets of candidates: every effect weighs the same; within an effect one value for all weighs half, or all
    targets the same, and so do the ways in which one of them may act.
    """

    places: tuple[PlacedCause, ...]
    _priors: dict[tuple[Members, Members], float] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def columns(self) -> tuple[tuple[int, ...], ...]:
        """Of every candidate."""
        return tuple(each.columns for each in self.places)

    @cached_property
    def _targets(self) -> dict[str, tuple[int, ...]]:
        """Candidates of every effect that have a target."""
        named = {each.effect: () for each in self.places}
        return {
            name: tuple(i for i, each in enumerate(self.places) if each.effect == name and each.target is not None)
            for name in named
        }

    @cached_property
    def _weight(self) -> list[float]:
        """Log prior weight of every candidate as a member."""
        of_all = {each.effect for each in self.places if each.target is None}
        out = []
        for each in self.places:
            targets = len(self._targets[each.effect])
            share = 1.0 if not (each.effect in of_all and targets) else 0.5
            out.append(log(share / (targets if each.target is not None else 1) / len(self._targets) / each.ways))
        return out

    def exclusive(self, i: int, j: int) -> bool:
        """Whether two candidates make no sense together: an effect at one target and at all."""
        a, b = self.places[i], self.places[j]
        return a.effect == b.effect and (a.target is None or b.target is None)

    def prior(self, members: Members, minor: Members = ()) -> float:
        """Log prior probability of a set with its minor effects; cached.

        One by one, or one effect at several targets is one cause, by whatever all of these have in common. Minor ones have no
        part in common with them: three of a kind are one thing, two and a minor one are not.
        """
        if (members, minor) not in self._priors:
            impossible = any(self.exclusive(i, j) for i, j in combinations(members, 2))
            self._priors[members, minor] = -np.inf if impossible else self._prior(members, minor)
        return self._priors[members, minor]

    def value(self, f: Fitted, temperature: float = 1.0) -> float:
        """Tempered log evidence of a set with its minor effects, plus their log prior."""
        return f.log_evidence / temperature + self.prior(f.members, f.minor)

    def _prior(self, members: Members, minor: Members) -> float:
        one_by_one = _in_any_order([self._weight[i] for i in (*members, *minor)])
        groups = [(tuple(i for i in members if i in kind), len(kind)) for kind in self._targets.values()]
        groups = [(mine, of) for mine, of in groups if len(mine) >= PATTERN]
        if not groups:
            return one_by_one
        weights = [self._weight[i] for i in (*members, *minor) if not any(i in mine for mine, _ in groups)]
        for mine, of in groups:
            more = 0.5 ** np.arange(of - PATTERN + 1)  # halving with every further target, and any so many of them
            these = more[len(mine) - PATTERN] / more.sum() / comb(of, len(mine))
            weights.append(self._weight[mine[0]] + log(of * these))
        return float(np.logaddexp(one_by_one, len(groups) * log(EVEN) + _in_any_order(weights)))


def _in_any_order(weights: Sequence[float]) -> float:
    """Log prior probability of causes of these log weights, drawn one after the other."""
    d = len(weights)
    return log(SIZES[d] * factorial(d)) + sum(weights)


def weighed(data: NormalEquations, prior: Prior, candidates: CausePrior) -> Reduced:
    """Sets of candidates with their evidence about one fit, all columns within tolerance integrated out."""
    k = len(prior.tolerance)
    at, P, seen = _posterior(data, prior.precision), prior.precision, np.diag(data.A)
    units = [prior.unit[list(own)] / np.sqrt(len(own)) * seen[list(own)].any() for own in candidates.columns]
    end = np.full(k, np.inf)
    return Reduced(
        gram=np.diag(P) - P[:, None] * at.covariance(range(k)) * P, moment=P * at.mean, none=at.log_evidence,
        candidates=candidates.places, units=units, log_prior=candidates.prior,
        bounds=AmplitudeBounds(-end, end, prior.sign, np.zeros(k, bool)),
    )  # fmt: skip


def _posterior(data: NormalEquations, precision: Floats) -> AmplitudePosterior:
    return AmplitudePosterior.of(data, precision, np.arange(len(precision)))


def estimate(data: NormalEquations, prior: Prior, members: Sequence[int]) -> tuple[Floats, Floats]:
    """Mode (k,) and covariance (k, k) with the columns `members` free within 10 scales, the others within tolerance."""
    at = _posterior(data, prior.precision_beside(members))
    return at.mean, at.covariance(range(len(at.mean)))


def misfit(data: NormalEquations, prior: Prior, members: Sequence[int]) -> float:
    """Minimum chi-square with the columns `members` free and all others within tolerance, penalties included."""
    mean, _ = estimate(data, prior, members)
    precision = prior.precision
    precision[list(members)] = 0.0
    return float(data.c - 2.0 * data.b @ mean + mean @ data.A @ mean + precision @ mean**2)


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


def probabilities(fits: Sequence[Fitted], candidates: CausePrior, temperature: float = 1.0) -> Floats:
    """Posterior probability of every set among those fitted."""
    value = np.array([candidates.value(f, temperature) for f in fits])
    return np.asarray(np.exp(value - logsumexp(value)), float)
