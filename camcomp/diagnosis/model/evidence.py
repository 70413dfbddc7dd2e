"""Log evidence of sets of causes, in closed form from normal equations (spike and slab).

A column of a cause has a slab of one of several WIDTHS, measured in noise floors of its effect on the channels, up to what
these are off; every other column has the spike: the small errors of a healthy machine (ridge). Nuisances are free.
Amplitudes, nuisances and the dictionary are integrated out.

Source: George, McCulloch, Statistica Sinica 7 (1997) 339; half-normal slabs where an amplitude has a sign.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import comb, log

import numpy as np
from scipy.special import log_ndtr

from camcomp.diagnosis.model.candidates import AmplitudeBounds, PlacedCause
from camcomp.diagnosis.model.group import (
    ColumnLayout,
    Group,
    SmoothProcess,
    normal_equations,
)
from camcomp.diagnosis.model.noise import HEALTHY
from camcomp.diagnosis.statistics.normal_equations import AmplitudePosterior, NormalEquations, sum_grams
from camcomp.ground.datatypes import Floats, Ints

WIDTHS = (2.0, 6.0, 20.0, 60.0, 200.0)  # of the floor: effect of a cause on the channels
SIZES = (0.45, 0.33, 0.13, 0.055, 0.022, 0.009, 0.004)  # prior probability of 0, 1, 2 ... causes
LONG = 20  # columns: a longer candidate has no small errors
FREE = 1e-6  # precision of nuisances in units of their columns
LEAST_VISIBLE = 1e-6  # of a column's size: what nuisances leave of it; below, the column is not seen
Members = tuple[int, ...]


@dataclass(frozen=True)
class Background:
    """Noise, discrepancy and families that act jointly with single causes, each with its scale in floors.

    noise: factor on the noise. scales: covariates of the dictionary. families: effects at all their targets. process: a
    smooth process.
    """

    noise: float = 1.0
    scales: tuple[tuple[str, float], ...] = ()
    families: tuple[tuple[str, float], ...] = ()
    process: SmoothProcess | None = None

    @property
    def unknown(self) -> bool:
        """Whether a covariate or a process of the dictionary acts."""
        return bool(self.scales or self.process)


@dataclass(eq=False, kw_only=True)
class LinearModel:
    """Groups with their candidates, linearised at one state; normal equations are kept per process.

    fitted: indices of the groups that are fitted, None for all; the others are judged only. families: effect -> its columns
    at all targets. healthy: covariates that are always there, with the scale that healthy machines and instruments have,
    in floors. floors: noise of the groups in floors, more than 1 where their rows count for less. places: at which causes may
    act, None: those of the candidates.
    """

    groups: tuple[Group, ...]
    candidates: tuple[PlacedCause, ...]
    bounds: AmplitudeBounds
    fitted: tuple[int, ...] | None = None
    families: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    healthy: Mapping[str, float] = field(default_factory=dict)
    floors: float = 1.0
    places: int | None = None

    def __post_init__(self) -> None:
        self.layout = ColumnLayout.of(self.groups)
        self._grams: dict[SmoothProcess | None, tuple[NormalEquations, ...]] = {}
        self._totals: dict[tuple[SmoothProcess | None, tuple[int, ...]], NormalEquations] = {}
        self._reduced: dict[Background, Reduced] = {}
        self.candidates = tuple(self._seen(each) for each in self.candidates)

    def with_columns(self, kept: np.ndarray) -> LinearModel:
        """The model with the effect columns outside of a mask (k,) set to zero."""
        return replace(self, groups=tuple(replace(g, A=np.where(kept, g.A, 0.0)) for g in self.groups))

    def _seen(self, candidate: PlacedCause) -> PlacedCause:
        """A candidate without the columns that nuisances take up, where they leave some of it."""
        seen = tuple(j for j in candidate.columns if self.size[j] > 0.0)
        return replace(candidate, columns=seen) if 0 < len(seen) < len(candidate.columns) else candidate

    def grams(self, process: SmoothProcess | None = None) -> tuple[NormalEquations, ...]:
        """Normal equations of every group."""
        if process not in self._grams:
            self._grams[process] = tuple(normal_equations(g, self.layout, process) for g in self.groups)
        return self._grams[process]

    @property
    def own(self) -> tuple[int, ...]:
        """Indices of the groups that are fitted."""
        return tuple(range(len(self.groups))) if self.fitted is None else self.fitted

    @cached_property
    def size(self) -> Floats:
        """Effect (k,) on the channels of one unit of every column, in floors (rms), nuisances taken out; 0: not seen."""
        k, A = self.layout.effects, self.total(None).A
        own = list(range(k, k + sum(s.stop - s.start for s in self.layout.nuisances.values())))
        N, X = A[np.ix_(own, own)], A[np.ix_(own, range(k))]
        scale = 1.0 / np.sqrt(np.maximum(np.diag(N), 1e-300))
        inverse = np.linalg.pinv(scale[:, None] * N * scale, rcond=1e-12, hermitian=True)
        whole = np.diag(A)[:k]
        free = whole - np.einsum("ij,ik,kj->j", scale[:, None] * X, inverse, scale[:, None] * X, optimize=True)
        seen = free > LEAST_VISIBLE * np.maximum(whole, LEAST_VISIBLE * self.rows)
        return np.where(seen, self.floors * np.sqrt(np.where(seen, free, 1.0) / self.rows * self.channels), 0.0)

    @cached_property
    def widths(self) -> tuple[float, ...]:
        """Widths of slabs in floors: WIDTHS, and two more a decade up to what the channels are off beside nuisances."""
        free = np.full(self.layout.size, np.inf)
        for own in self.layout.nuisances.values():
            free[own] = FREE
        left = AmplitudePosterior.of(self.total(None), free)
        square = max(left.data.c - float(left.target @ left.target), 0.0)
        off = self.floors * float(np.sqrt(square / self.rows * self.channels))
        more = np.arange(1.0, np.ceil(2.0 * np.log10(max(off, 1.0) / WIDTHS[-1])) + 1.0)
        return (*WIDTHS, *(WIDTHS[-1] * 10.0 ** (0.5 * more)).tolist())

    @property
    def rows(self) -> int:
        """Number of values."""
        return sum(self.grams()[i].rows for i in self.own)

    @property
    def channels(self) -> int:
        """Channels per row."""
        return int(self.groups[0].y.shape[1])

    @cached_property
    def small(self) -> Floats:
        """Width (k,) of the small error of every column, 0 where it has none."""
        out = np.zeros(self.layout.effects)
        for c in (each for each in self.candidates if len(each.columns) <= LONG):
            own = [j for j in c.columns if self.size[j] > 0.0 and not (self.bounds.shaped[j] and c.ways > 1.0)]
            out[own] = np.maximum(out[own], HEALTHY / (self.size[own] * np.sqrt(len(c.columns) * c.ways)))
        return out

    def family(self, name: str) -> tuple[Ints, Floats]:
        """Columns (d,) of a family that are seen, and their amplitudes (d,) at which it acts by one floor in all."""
        on = np.array([j for j in self.families[name] if self.size[j] > 0.0], int)
        return on, self.unit(on)

    def unit(self, columns: Ints) -> Floats:
        """Amplitudes (d,) at which columns act by one floor in equal parts, 0 where one is not seen.

        The widest slab of an amplitude reaches to its bound: nuisances may hide nearly all that a column does.
        """
        size, bounds = self.size[columns], self.bounds
        if not (size > 0.0).all():
            return np.zeros(len(columns))
        most = np.maximum(np.abs(bounds.low[columns]), np.abs(bounds.high[columns])) / self.widths[-1]
        return np.asarray(np.minimum(1.0 / (size * np.sqrt(max(len(columns), 1))), most), float)

    def precision(self, background: Background, slab: Mapping[int, float] | None = None) -> Floats:
        """Prior precision (q,) of all columns, infinite where one takes no part; slab: width of the columns of causes."""
        out = np.full(self.layout.size, np.inf)
        for own in self.layout.nuisances.values():
            out[own] = FREE
        for name, scale in (*self.healthy.items(), *background.scales):
            out[self.layout.covariates[name]] = 1.0 / scale**2
        width = self.small * background.noise
        for name, scale in background.families:
            on, unit = self.family(name)
            width[on] = np.hypot(width[on], scale * unit)
        for j, more in (slab or {}).items():
            width[j] = np.hypot(width[j], more)
        acts = (width > 0.0) & (self.size > 0.0)
        out[: self.layout.effects][acts] = 1.0 / width[acts] ** 2
        return out

    def total(self, process: SmoothProcess | None, groups: Sequence[int] | None = None) -> NormalEquations:
        """Normal equations of some groups, or of all that are fitted."""
        key = process, tuple(self.own if groups is None else groups)
        if key not in self._totals:
            every = self.grams(process)
            self._totals[key] = sum_grams([every[i] for i in key[1]])
        return self._totals[key]

    def posterior(
        self,
        background: Background,
        slab: Mapping[int, float] | None = None,
        groups: Sequence[int] | None = None,
        absent: Sequence[int] = (),
    ) -> AmplitudePosterior:
        """Normal distribution of all columns except `absent`, from the given groups or from all fitted ones."""
        precision = self.precision(background, slab)
        precision[list(absent)] = np.inf
        return AmplitudePosterior.of(self.total(background.process, groups).with_noise(background.noise), precision)

    def log_evidence(self, background: Background, slab: Mapping[int, float]) -> float:
        """Log evidence of causes with their slab, from the columns alone that take part."""
        if background.process is None or background.process in self._grams:
            return self.posterior(background, slab).log_evidence
        precision = self.precision(background, slab)
        on = np.flatnonzero(np.isfinite(precision))
        data = [normal_equations(self.groups[g], self.layout, background.process, on) for g in self.own]
        return AmplitudePosterior.of(sum_grams(data).with_noise(background.noise), precision[on]).log_evidence

    def reduced(self, background: Background) -> Reduced:
        """Normal equations of the effects with all else integrated out."""
        if background not in self._reduced:
            at = self.posterior(background)
            k = self.layout.effects
            effects = np.flatnonzero(self.size > 0.0)
            own, by = at.blocks_without([effects])[0]
            gram, moment = np.zeros((k, k)), np.zeros(k)
            gram[np.ix_(effects, effects)], moment[effects] = own, by
            self._reduced[background] = Reduced(
                candidates=self.candidates, units=self._units, bounds=self.bounds, prior=self._log_prior, gram=gram,
                moment=moment, none=at.log_evidence, widths=self.widths,
            )  # fmt: skip
        return self._reduced[background]

    @cached_property
    def _units(self) -> list[Floats]:
        """Amplitudes (d,) of every candidate at which it acts by one floor, its columns in equal parts."""
        return [self.unit(np.array(c.columns, int)) for c in self.candidates]

    def _log_prior(self, members: Members) -> float:
        """Log prior of a set: its number of causes, places equally likely, shapes of a place equally likely."""
        places = len({c.place for c in self.candidates}) if self.places is None else self.places
        return log(SIZES[len(members)] / comb(places, len(members))) - sum(
            log(self.candidates[i].ways) for i in members
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class Reduced:
    """Sets of candidates weighed by the normal equations of the effects with all else integrated out.

    units: amplitudes (d,) of every candidate in which `widths` are counted, 0 where one is not seen. prior: log prior of a
    set. gram (k, k), moment (k,); none: log evidence of no cause at all.
    """

    candidates: Sequence[PlacedCause]
    units: Sequence[Floats]
    bounds: AmplitudeBounds
    prior: Callable[[Members], float]
    gram: Floats
    moment: Floats
    none: float
    widths: tuple[float, ...] = WIDTHS

    @property
    def usable(self) -> list[int]:
        """Candidates all of whose columns are seen."""
        return [i for i, unit in enumerate(self.units) if unit.all()]

    def units_of(self, members: Members) -> Floats:
        """Units (d,) of the columns of members."""
        return np.concatenate([np.zeros(0), *(self.units[i] for i in members)])

    def indices(self, members: Members) -> list[int]:
        """Columns of members, one after the other."""
        return [j for i in members for j in self.candidates[i].columns]

    def value(self, members: Members) -> float:
        """Log posterior of a set up to a constant, evidence and prior."""
        if not members:
            return self.none + self.prior(())
        return float(self.with_one_more(members[:-1], members[-1:])[0])

    def with_one_more(self, members: Members, more: Sequence[int]) -> Floats:
        """Log posterior (s,) of a set with one candidate more each, up to a constant."""
        out = np.array([self.none + self.prior((*members, i)) for i in more])
        count = np.array([len(self.candidates[i].columns) for i in more])
        for d in np.unique(count):
            own = np.flatnonzero(count == d)
            value = self._posterior(members, [more[i] for i in own.tolist()])[0]
            most = value.max(axis=1)
            base = np.where(np.isfinite(most), most, 0.0)
            with np.errstate(divide="ignore"):
                out[own] += base + np.log(np.exp(value - base[:, None]).mean(axis=1))
        return out

    def estimate(self, members: Members) -> tuple[Floats, Floats, float]:
        """Amplitudes (d,), covariance (d, d) and the most probable width, small errors integrated out."""
        value, mean = self._posterior(members[:-1], members[-1:])
        w = int(np.argmax(value[0]))
        on, unit = self.indices(members), self.units_of(members)
        M = unit[:, None] * self.gram[np.ix_(on, on)] * unit + np.eye(len(on)) / self.widths[w] ** 2
        return mean[0, w], unit[:, None] * np.linalg.inv(M) * unit, self.widths[w]

    def slab(self, members: Members) -> dict[int, float]:
        """Width of the columns of members, where their slab is the most probable one."""
        if not members:
            return {}
        width = self.estimate(members)[2]
        return dict(zip(self.indices(members), (width * self.units_of(members)).tolist(), strict=True))

    def _posterior(self, members: Members, more: Sequence[int]) -> tuple[Floats, Floats]:
        """Log evidence (s, widths) and amplitudes (s, widths, d) of a set with one of s candidates more, each of e columns.

        The columns of the set are eliminated once.
        """
        old, new = np.array(self.indices(members), int), np.array([self.candidates[i].columns for i in more])
        a, b = self.units_of(members), np.array([self.units[i] for i in more])
        square = np.array(self.widths) ** 2
        A = a[:, None] * self.gram[np.ix_(old, old)] * a + np.eye(len(a)) / square[:, None, None]  # (widths, o, o)
        B = a[:, None] * self.gram[old[:, None], new[:, None, :]] * b[:, None, :]  # (s, o, e)
        C = b[:, :, None] * self.gram[new[:, :, None], new[:, None, :]] * b[:, None, :]
        P = np.linalg.inv(A)
        alone = P @ (a * self.moment[old])  # (widths, o)
        taken = np.einsum("wop,spe->swoe", P, B, optimize=True)
        S = C[:, None] + np.eye(b.shape[1]) / square[:, None, None]
        S = S - np.einsum("soe,swof->swef", B, taken, optimize=True)
        Q = np.linalg.inv(S)
        left = (b * self.moment[new])[:, None] - np.einsum("soe,wo->swe", B, alone, optimize=True)
        gained = (Q @ left[..., None])[..., 0]
        value = 0.5 * ((alone @ (a * self.moment[old]))[None] + (left * gained).sum(axis=2))
        value -= 0.5 * (np.linalg.slogdet(A)[1] + np.linalg.slogdet(S)[1] + (len(a) + b.shape[1]) * np.log(square))
        mean = np.concatenate([alone[None] - (taken @ gained[..., None])[..., 0], gained], axis=2)
        variance = np.concatenate(
            [
                np.diagonal(P, axis1=1, axis2=2)[None] + ((taken @ Q) * taken).sum(axis=3),
                np.diagonal(Q, axis1=2, axis2=3),
            ],
            axis=2,
        )
        on = np.concatenate([np.broadcast_to(old, (len(new), len(old))), new], axis=1)[:, None, :]
        unit = np.concatenate([np.broadcast_to(a, (len(b), len(a))), b], axis=1)[:, None, :]
        mean, sd = unit * mean, unit * np.sqrt(np.maximum(variance, 0.0))
        return value + self._inside(mean, sd, on), mean

    def _inside(self, mean: Floats, sd: Floats, on: np.ndarray) -> Floats:
        """Log share (s, widths) of the posterior that has the right signs; minus infinity far outside of the bounds."""
        bounds = self.bounds
        signed = bounds.sign[on] > 0.0
        share = log_ndtr(np.where(signed, mean / np.maximum(sd, 1e-300), 0.0)) + log(2.0)
        out = np.where(signed, share, 0.0).sum(axis=2)
        outside = (mean < bounds.low[on] - 3.0 * sd) | (mean > bounds.high[on] + 3.0 * sd)
        return np.where(outside.any(axis=2), -np.inf, out)
