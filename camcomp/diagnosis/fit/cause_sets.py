"""Sets of causes of programs: what is known of a fitted one, their prior, and their evidence at one state of the machine.

The evidence is that of model/evidence, with tolerances in place of spikes (`statistics/evidence.py`) and slabs in typical sizes.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations, pairwise
from math import comb, factorial

import numpy as np

from camcomp.diagnosis.model.candidates import AmplitudeBounds, PlacedCause
from camcomp.diagnosis.model.evidence import SIZES, Members, Reduced
from camcomp.diagnosis.statistics.evidence import PRIOR_WIDTHS, Prior, holding_back, misfit, posterior
from camcomp.diagnosis.statistics.normal_equations import NormalEquations, sum_grams
from camcomp.diagnosis.statistics.probability import EVEN, TEMPERATURE
from camcomp.ground.datatypes import Floats

PATTERN = 3  # targets of one effect from which on they may have one origin: springs of several joints are one thing that gives way
ALL_PARTS = 3  # members up to which every part of a set is looked at; of larger ones all but one, each alone, and none


@dataclass(frozen=True, eq=False, kw_only=True)
class Fitted:
    """A set of causes with the evidence for it. theta (d,): coordinates of its columns in units of their scales."""

    members: Members
    theta: Floats
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
    kinds: tuple[tuple[int, ...], ...] = ()  # candidates that are one effect at several targets, with equal weights
    _priors: dict[tuple[Members, Members], float] = field(default_factory=dict, init=False, repr=False)

    def prior(self, members: Members, minor: Members = ()) -> float:
        """Log prior probability of a set with its minor effects; cached."""
        members = tuple(sorted(members))
        if (members, minor) not in self._priors:
            apart = any(self.exclusive(*both) for both in combinations(members, 2))
            self._priors[members, minor] = -np.inf if apart else float(np.logaddexp.reduce(self._ways(members, minor)))
        return self._priors[members, minor]

    def value(self, f: Fitted, temperature: float = 1.0) -> float:
        """Tempered log evidence of a set with its minor effects, plus their log prior."""
        return f.log_evidence / temperature + self.prior(f.members, f.minor)

    def _ways(self, members: Members, minor: Members) -> list[float]:
        """Log prior probability of each way in which a set may have come about.

        One by one; or one effect at several targets is one cause, by whatever all of these have in common. Minor ones have no
        part in common with them: three of a kind are one thing, two and a minor one are not.
        """
        ways = [_in_any_order([float(self.weight[i]) for i in (*members, *minor)])]
        groups = [(tuple(i for i in members if i in kind), len(kind)) for kind in self.kinds]
        groups = [(mine, of) for mine, of in groups if len(mine) >= PATTERN]
        if not groups:
            return ways
        rest = [i for i in (*members, *minor) if not any(i in mine for mine, _ in groups)]
        weights = [float(self.weight[i]) for i in rest]
        for mine, of in groups:
            more = 0.5 ** np.arange(of - PATTERN + 1)  # halving with every further target, and any so many of them
            these = more[len(mine) - PATTERN] / more.sum() / comb(of, len(mine))
            weights.append(float(self.weight[mine[0]]) + float(np.log(of * these)))
        return [*ways, len(groups) * float(np.log(EVEN)) + _in_any_order(weights)]


def _in_any_order(weights: Sequence[float]) -> float:
    """Log prior probability of causes of these log weights, drawn one after the other."""
    d = len(weights)
    return float(np.log(SIZES[d] * factorial(d))) + sum(weights)


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
    """Evidence of sets of candidates for one gram; at: the posterior of no cause."""

    def __init__(self, data: NormalEquations, prior: Prior, candidates: CausePrior) -> None:
        self.prior, self.candidates = prior, candidates
        self.at = posterior(data, prior)

    def __call__(self, members: Members) -> float:
        """Log evidence of a set, with all that is no member within reach."""
        columns = [c for i in members for c in self.candidates.columns[i]]
        linear = self.sets(members).value(tuple(range(len(members)))) - self.candidates.prior(members)
        return linear - holding_back(self.at, self.prior, columns)

    def sets(self, some: Sequence[int]) -> Reduced:
        """Sets of some candidates, weighed by the evidence linearised about one fit, tolerances as stated; the causes of a set have one
        width in their typical sizes.
        """
        columns = [self.candidates.columns[i] for i in some]
        on, ends = np.array([c for own in columns for c in own], int), np.cumsum([0, *map(len, columns)]).tolist()
        gram, moment = self.at.blocks_without([on])[0]
        most, seen = np.full(len(on), np.inf), np.diag(self.at.data.A) > 0.0
        return Reduced(
            candidates=[PlacedCause(str(i), None, tuple(range(*at))) for i, at in zip(some, pairwise(ends), strict=True)],
            units=[np.full(len(own), float(seen[list(own)].any())) for own in columns],
            bounds=AmplitudeBounds(-most, most, self.prior.sign[on], most < 0.0), gram=gram, moment=moment,
            prior=lambda members: self.candidates.prior(tuple(some[i] for i in members)),
            none=self.at.log_evidence, widths=PRIOR_WIDTHS,
        )  # fmt: skip


def scored(scale: Scale, sets: Iterable[Members]) -> list[tuple[float, Members]]:
    """Log evidence + log prior of sets, best first."""
    return sorted(((scale(each) + scale.candidates.prior(each), each) for each in sets), reverse=True)


def probabilities(fits: Sequence[Fitted], candidates: CausePrior, temperature: float = 1.0) -> Floats:
    """Posterior probability of every set among those fitted."""
    value = np.array([candidates.value(f, temperature) for f in fits])
    return np.asarray(np.exp(value - np.logaddexp.reduce(value)))
