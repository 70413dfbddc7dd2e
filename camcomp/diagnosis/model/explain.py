"""From a linear model to its explanation: probable sets of causes, and whether something unmodelled acts beside them.

Steps: search sets beside noise alone; weigh every covariate and process beside the best set and its parts; search sets
again beside the most probable discrepancy; weigh the noise itself. All sets and backgrounds that were weighed share one
posterior.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import log

import numpy as np
from scipy.special import logsumexp

from camcomp.diagnosis.model.candidates import Place
from camcomp.diagnosis.model.discrepancy import (
    LENGTHS,
    SCALES,
    UNKNOWN,
    fit_process,
    gains_of_more,
    prior_of_covariate,
    prior_of_family,
    residuals,
)
from camcomp.diagnosis.model.evidence import Background, LinearModel, Members, Reduced
from camcomp.diagnosis.model.search import ROUNDS, best_of, search_sets
from camcomp.ground.datatypes import Floats

STATED = 0.08  # log deviation of a stated noise: instruments know themselves to an eighth in the square
NOISES = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 6.0, 9.0)  # factors on the floor


@dataclass(frozen=True)
class KnownNoise:
    """How well the noise of the groups is known: freedom, the number of values it rests on, infinite where it is stated.

    None in place of it: unknown, so that unmodelled terms cannot be seen by the size of the residual.
    """

    freedom: float = np.inf

    def log_prior(self, factor: float) -> float:
        """Log prior of a factor on the noise, noise as stated against unmodelled excess of any size."""
        return float(np.logaddexp(*self._log_priors(factor)))

    def unmodelled(self, factor: float) -> float:
        """Probability that a factor on the noise is unmodelled excess."""
        return float(np.exp(self._log_priors(factor)[1] - self.log_prior(factor)))

    def _log_priors(self, factor: float) -> tuple[float, float]:
        spread = np.hypot(STATED, 1.0 / np.sqrt(2.0 * self.freedom))
        outside = log(UNKNOWN / (1.0 - UNKNOWN)) - log(len(NOISES)) if factor > 1.0 else -np.inf
        return float(-0.5 * (log(factor) / spread) ** 2), outside


@dataclass(frozen=True, eq=False, kw_only=True)
class Explanation:
    """The posterior over sets and backgrounds.

    members: the most probable set, beside `background`. sets: members, the places of these and of the families beside them, and
    probability, one entry per set of places, the most probable first; places, families: probability of every place and family;
    unknown: that something unmodelled acts.
    """

    model: LinearModel
    background: Background
    members: Members
    sets: tuple[tuple[Members, frozenset[Place], float], ...]
    places: dict[Place, float]
    families: dict[str, float]
    unknown: float
    log_evidence: float

    @cached_property
    def data(self) -> Reduced:
        """The normal equations of the effects under the background."""
        return self.model.reduced(self.background)

    def amplitudes(self) -> tuple[Floats, Floats]:
        """Amplitudes (k,) of the most probable set and its families, 0 elsewhere, and their covariance (k, k)."""
        k = self.model.layout.effects
        amount, covariance = np.zeros(k), np.zeros((k, k))
        if self.members:
            data = self.data
            on = data.indices(self.members)
            amount[on], covariance[np.ix_(on, on)], _ = data.estimate(self.members)
        if self.background.families:
            on, absent, slab = self.columns, list[int](), self.data.slab(self.members)
            while True:
                at = self.model.posterior(self.background, slab, absent=absent)
                below = [j for j in on if self.model.bounds.sign[j] > 0.0 and at.mean[j] < 0.0]
                if not below:
                    break
                absent, on = [*absent, *below], [j for j in on if j not in below]
            amount = np.zeros(k)
            amount[on] = at.mean[on]
            covariance[np.ix_(on, on)] = at.covariance(on)
        return amount, covariance

    def odds_of(self, columns: Sequence[int]) -> float:
        """Log odds of some columns of a family against their absence, all else as it is."""
        slab = self.data.slab(self.members)
        both = [self.model.posterior(self.background, slab, absent=each).log_evidence for each in ((), columns)]
        return both[0] - both[1]

    @property
    def columns(self) -> list[int]:
        """Columns of the most probable set and of the families in the background."""
        own = {j for name, _ in self.background.families for j in self.model.family(name)[0].tolist()}
        return sorted({*own, *self.data.indices(self.members)})


def explain(model: LinearModel, noise: KnownNoise | None, start: Background | None = None) -> Explanation:
    """Sets of causes and the model discrepancy, from all fitted groups; start: a background to begin with."""
    weighed: dict[Background, dict[Members, float]] = {}

    def search_beside(background: Background) -> dict[Members, float]:
        found = search_sets(model.reduced(background))
        prior = log_prior(model, background, noise)
        weighed[background] = {m: v + prior for m, v in found.items()}
        return found

    background = best_noise(model, Background(), {}, None) if noise is None else Background()
    if start is not None and start != background:
        search_beside(background)
        background = start
    for _ in range(ROUNDS + 1):
        found = search_beside(background)
        options = further_backgrounds(model, background, found, noise)
        options = {b: v for b, v in options.items() if b not in weighed}
        for b, (members, value) in options.items():
            weighed.setdefault(b, {})[members] = value
        best = max(options, key=lambda b: options[b][1], default=None)
        if best is None or options[best][1] <= max(weighed[background].values()):
            break
        background = best
    return posterior_of(model, weighed, noise)


def log_prior(model: LinearModel, background: Background, noise: KnownNoise | None) -> float:
    """Log prior of a background."""
    out = 0.0 if noise is None else noise.log_prior(background.noise)
    out += len(background.scales) * (prior_of_covariate(model) - log(len(SCALES)))
    out += len(background.families) * (prior_of_family(model) - log(len(SCALES)))
    return out + (prior_of_covariate(model) if background.process else 0.0)


def further_backgrounds(
    model: LinearModel, background: Background, found: Mapping[Members, float], noise: KnownNoise | None
) -> dict[Background, tuple[Members, float]]:
    """Backgrounds with one discrepancy more, each with the set of `found` that goes best with it and its log posterior.

    Looked at are the best set and its parts: a large set takes up what is unmodelled.
    """
    data = model.reduced(background)
    prior = log_prior(model, background, noise)
    out: dict[Background, tuple[Members, float]] = {}

    def consider(b: Background, members: Members, value: float) -> None:
        if b not in out or value > out[b][1]:
            out[b] = members, value

    parts = parts_of(data, best_of(found))
    for members in parts:
        here = found.get(members, data.value(members)) + prior
        for b, gain in gains_of_more(model, background, members).items():
            consider(b, members, here + gain)
    for members in dict.fromkeys((parts[0], parts[-1])):
        slab = data.slab(members)
        here = found.get(members, data.value(members)) - model.log_evidence(background, slab)
        others = [best_noise(model, background, slab, noise)]
        if background.process is None and (members == parts[0] or not background.scales):
            left = residuals(model, background, members)
            for over in LENGTHS:
                process = fit_process([model.groups[g] for g in model.own], left, over)
                others += [replace(background, process=process)] if process else []
        for b in others:
            if b != background:
                consider(b, members, here + model.log_evidence(b, slab) + log_prior(model, b, noise))
    return out


def parts_of(data: Reduced, members: Members) -> list[Members]:
    """A set, and what remains of it when the member that is worth least is dropped, again and again."""
    out = [members]
    while members:
        less = [(*members[:i], *members[i + 1 :]) for i in range(len(members))]
        members = max(less, key=data.value)
        out.append(members)
    return out


def best_noise(
    model: LinearModel, background: Background, slab: Mapping[int, float], noise: KnownNoise | None
) -> Background:
    """The background with the most probable factor on the noise, climbing from the nearest of NOISES."""
    known: dict[int, float] = {}

    def value(i: int) -> float:
        if i not in known:
            b = replace(background, noise=NOISES[i])
            known[i] = model.log_evidence(b, slab) + log_prior(model, b, noise)
        return known[i]

    at = int(np.argmin(np.abs(np.array(NOISES) - background.noise)))
    while True:
        near = [i for i in (at - 1, at, at + 1) if 0 <= i < len(NOISES)]
        best = max(near, key=value)
        if best == at:
            return replace(background, noise=NOISES[at])
        at = best


def posterior_of(
    model: LinearModel,
    weighed: dict[Background, dict[Members, float]],
    noise: KnownNoise | None = KnownNoise(),
) -> Explanation:
    """The posterior over everything that was weighed; sets of the same places, those of families included, count as one.

    Where the noise is not known it may be a discrepancy of any form: the data do not change the probability of that, and
    beside such a discrepancy they do not determine causes.
    """
    hidden = UNKNOWN if noise is None else 0.0
    flat = [(b, m, v) for b, own in weighed.items() for m, v in own.items()]
    value = np.array([v for _, _, v in flat])
    p = (1.0 - hidden) * np.exp(value - logsumexp(value))
    places: dict[Place, float] = {}
    families: dict[str, float] = {}
    merged: dict[frozenset[Place], tuple[Members, float, float]] = {}
    unknown = hidden
    for (background, members, _), each in zip(flat, p.tolist(), strict=True):
        if background.unknown:
            unknown += each
        elif noise is not None:
            unknown += each * noise.unmodelled(background.noise)
        for name, _ in background.families:
            families[name] = families.get(name, 0.0) + each
        together = {name for name, _ in background.families}
        own = frozenset(c.place for i, c in enumerate(model.candidates) if i in members or c.effect in together)
        for place in own:
            places[place] = places.get(place, 0.0) + each
        first, most, total = merged.get(own, (members, 0.0, 0.0))
        merged[own] = (members if each > most else first, max(most, each), total + each)
    sets = sorted(((m, own, total) for own, (m, _, total) in merged.items()), key=lambda s: -s[2])
    top = int(np.argmax(value))
    return Explanation(
        model=model, background=flat[top][0], members=flat[top][1], sets=tuple(sets), places=places,
        families=families, unknown=unknown, log_evidence=float(value[top]),
    )  # fmt: skip
