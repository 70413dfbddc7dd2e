"""Sets of causes of a channel of an axis, made linear where they stand, with their shapes.

Responses of causes that act together are computed together. Shapes of causes (a speed, a dead time, a distance) are refined
jointly with the amplitudes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from camcomp.diagnosis.axis.channel_data import ChannelData, shrunk
from camcomp.diagnosis.axis.effect_columns import AxisCause
from camcomp.diagnosis.axis.noise_floor import left_of_fit, noise_after_fit
from camcomp.diagnosis.model.candidates import AmplitudeBounds, PlacedCause
from camcomp.diagnosis.model.discrepancy import covariate_columns, gains_of_more, smooth_functions
from camcomp.diagnosis.model.evidence import Background, LinearModel, Members
from camcomp.diagnosis.model.explain import Explanation, posterior_of
from camcomp.diagnosis.model.group import Group
from camcomp.diagnosis.model.search import search_sets
from camcomp.ground.datatypes import Floats, Ints

STEP = 1e-3  # of an amplitude in scales, for slopes
PASSES = 3  # in which columns are made linear again where the fit stands
MOST_CHANGE = 0.7  # of the logarithm of a shape in one step
CAUSES = 3  # of one channel of one axis
SHAPE_SD = 1.5  # of the logarithm of a shape: scans of shapes span four


@dataclass(frozen=True, eq=False)
class LinearChannel:
    """A channel made linear at amplitudes of its causes: columns (n, k) of all terms and the error of their tangents at 0 (n,),
    per run.
    """

    data: ChannelData
    terms: Sequence[AxisCause]
    responses: Sequence[tuple[Floats, Floats]]

    @staticmethod
    def at(data: ChannelData, terms: Sequence[AxisCause], at: Sequence[Floats]) -> LinearChannel:
        """The channel at amplitudes (d,) of all terms."""
        here = data.where(terms, at)
        return LinearChannel(here, terms, [joint_columns(here, terms, k, at) for k in range(len(data.values))])

    def with_misfit(self) -> LinearChannel:
        """The channel with the misfit that all columns leave."""
        return replace(self, data=self.data.with_misfit(left_of_fit(*self._columns)))

    @property
    def noise(self) -> float:
        """Standard deviation of a row that counts as one of its own, from residuals jointly with all columns.

        Rows that are correlated count for less: the variance is that of a row times the rows that count as one.
        """
        return noise_after_fit(*self._columns, self.data.floor)

    @property
    def _columns(self) -> tuple[Floats, Floats]:
        data = self.data
        A = data.in_floors({k: np.hstack((self.responses[k][0], data.healthy_columns(k))) for k in data.train})
        return A, data.in_floors({k: data.values[k] - self.responses[k][1] for k in data.train})

    def explained(self, sd: float, on: Members | None = None) -> LinearFit:
        """The posterior over sets of causes; on: this set alone."""
        data = self.data
        unit, ends = data.scales, covariate_ranges(data)
        groups = []
        for k in data.train:
            A, offset = self.responses[k]
            y = (data.values[k] - offset)[:, None]
            n = len(y)
            white = {kind: (own * unit[kind])[:, None] for kind, own in data.healthy[k].items()}
            smooth = {
                name: covariate_columns(smooth_functions(own, *ends[name]), np.full((n, 1, 1), sd))
                for name, own in data.covariates[k].items() if name in ends
            }  # fmt: skip
            groups.append(
                Group(
                    name=str(k), label="axis", y=y, A=A[:, None], N=np.zeros((n, 1, 0)),
                    sd=sd * data.noise(k)[:, None], B={**white, **smooth},
                )
            )  # fmt: skip
        start, placed = 0, []
        for term in self.terms:
            columns = tuple(range(start, start := start + len(term.parameters)))
            placed.append(PlacedCause(*term.place, columns, term.ways))
        bounds = AmplitudeBounds.of(
            [p for t in self.terms for p in t.parameters], [bool(t.shape) for t in self.terms for _ in t.parameters]
        )
        model = LinearModel(
            groups=tuple(groups), candidates=tuple(placed), bounds=bounds, healthy=dict.fromkeys(unit, 1.0),
            floors=sd / data.floor,
        )  # fmt: skip
        data_of = model.reduced(Background())
        values = search_sets(data_of, CAUSES) if on is None else {on: max(data_of.value(on), -1e300)}
        found = posterior_of(model, {Background(): values})
        return LinearFit(data=data, terms=self.terms, found=found, unit=unit, sd=sd)


@dataclass(frozen=True, eq=False, kw_only=True)
class LinearFit:
    """Posterior over sets of causes of a channel where they are made linear.

    unit: channel units per amplitude of its healthy columns (q,), by kind. sd: deviation of a row that counts as one.
    """

    data: ChannelData
    terms: Sequence[AxisCause]
    found: Explanation
    unit: Mapping[str, Floats]
    sd: float

    @property
    def members(self) -> Members:
        """Numbers of the causes that act."""
        return self.found.members

    @property
    def model(self) -> LinearModel:
        """The linear model."""
        return self.found.model

    @cached_property
    def amounts(self) -> list[Floats]:
        """Amplitudes (d,) of all terms, 0 of those that do not act."""
        return self.by_term(self.found.amplitudes()[0])

    @property
    def acting(self) -> tuple[list[AxisCause], list[Floats]]:
        """Causes that act, and their amplitudes (d,)."""
        return [self.terms[i] for i in self.members], [self.amounts[i] for i in self.members]

    def slots(self, name: str) -> Ints:
        """Columns of a kind of healthy sizes, or of a covariate."""
        layout = self.model.layout
        return np.arange(layout.size)[layout.covariates[name]]

    @property
    def functions(self) -> dict[str, Ints]:
        """Columns (q,) of the functions of every covariate."""
        return {name: self.slots(name) for name in self.model.layout.covariates if name not in self.unit}

    def columns(self, on: Ints | Sequence[int]) -> Floats:
        """Columns (n, k) of the model in all rows that were fitted."""
        layout = self.model.layout
        return np.concatenate([layout.design(g)[:, 0, on] for g in self.model.groups])

    def by_term(self, values: Floats) -> list[Floats]:
        """Values of all effect columns, and perhaps of others behind them, as those of every term (d,)."""
        return np.split(values, np.cumsum([len(t.parameters) for t in self.terms]))[: len(self.terms)]

    def settled(self, sd: float) -> LinearFit:
        """The fit of the same set where it stands, with another deviation of a row."""
        return settled(self.data, self.terms, self.amounts, on=self.members, sd=sd)

    @cached_property
    def value(self) -> float:
        """Log evidence, with a function of one covariate where that adds to it."""
        gains = gains_of_more(self.model, self.found.background, self.members)
        return float(self.found.log_evidence + max(0.0, *gains.values()))

    @cached_property
    def excess(self) -> float:
        """Mean square of what causes and healthy sizes, but for those that are minor, leave of the fitted runs, each row over its
        noise.
        """
        data, (left, _, sizes) = self.data, self.residuals(small=False)
        left = [y + sum(data.healthy[k][kind] @ sizes[kind] for kind in data.minor) for k, y in enumerate(left)]
        return float(np.mean(data.in_floors(dict(enumerate(left))) ** 2))

    def residuals(self, *, small: bool = True) -> tuple[list[Floats], list[Floats], dict[str, Floats]]:
        """Residuals (n,) per run, amplitudes of all terms, and healthy sizes by kind.

        small: whether causes that do not act have the small errors of a healthy machine.
        """
        data, found, model = self.data, self.found, self.model
        mean = model.posterior(found.background, found.data.slab(self.members)).mean
        sizes = {kind: unit * mean[model.layout.covariates[kind]] for kind, unit in self.unit.items()}
        errors = self.by_term(small * mean)
        amount = [a if i in self.members else errors[i] for i, a in enumerate(self.amounts)]
        left = []
        for k, y in enumerate(data.values):
            part = data.response(k, [(t, a) for t, a in zip(self.terms, amount, strict=True) if a.any()])
            left.append(y - part - sum((data.healthy[k][kind] @ sizes[kind] for kind in sizes), np.zeros(len(y))))
        return left, amount, sizes


def settled(
    data: ChannelData,
    terms: Sequence[AxisCause],
    at: Sequence[Floats],
    *,
    on: Members,
    sd: float,
    passes: int = PASSES,
) -> LinearFit:
    """The fit of one set of causes, made linear where it stands."""
    at = [each if i in on else np.zeros(len(each)) for i, each in enumerate(at)]
    for _ in range(passes):
        fit = LinearChannel.at(data, terms, at).explained(sd, on)
        at = fit.amounts
    return fit


def joint_columns(data: ChannelData, terms: Sequence[AxisCause], k: int, at: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Columns (n, k) of all terms jointly with those that act, and the error of their tangents at 0 (n,)."""
    acting = {i: (term, own) for i, (term, own) in enumerate(zip(terms, at, strict=True)) if own.any()}
    here = data.response(k, [*acting.values()])
    columns, offset = [np.zeros((len(here), 0))], here.copy()
    for i, (term, own) in enumerate(zip(terms, at, strict=True)):
        first = np.array(term.steps or np.ones(len(own)))
        step = np.where(own == 0.0, first, STEP * np.maximum(np.abs(own), first))
        others = [each for j, each in acting.items() if j != i]
        A = np.stack(
            [(data.response(k, [*others, (term, own + d)]) - here) / d[j] for j, d in enumerate(np.diag(step))], axis=1
        )
        columns.append(A)
        offset -= A @ own
    return np.concatenate(columns, axis=1), offset


def refined_shapes(
    data: ChannelData, terms: Sequence[AxisCause], members: Sequence[int], at: Sequence[Floats], sd: float
) -> tuple[list[AxisCause], list[Floats]]:
    """Terms and amplitudes after one Gauss-Newton step of the shapes of the causes that act, with the better setting of their
    switches, which only causes that act show; unchanged where the step does not help.
    """
    terms, at, base = [*terms], [*at], misfit(data, terms, members, at, sd)
    for i in members:
        for other in terms[i].other_settings:
            by = [*terms[:i], other, *terms[i + 1 :]]
            if (left := misfit(data, by, members, at, sd)) < base:
                terms, base = by, left
    names = scanned(terms, members)
    change, _ = jointly(data, terms, members, at, sd)
    for share in (1.0, 0.3, 0.1):
        moved, by, place = [*at], [*terms], 0
        for i in members:
            moved[i] = at[i] + share * change[place : (place := place + len(at[i]))]
        for (i, name), own in zip(names, change[place:], strict=True):
            factor = float(np.exp(np.clip(share * own, -MOST_CHANGE, MOST_CHANGE)))
            by[i] = replace(by[i], shape={**by[i].shape, name: terms[i].bounded(name, by[i].shape[name] * factor)})
        if misfit(data, by, members, moved, sd) < base:
            return by, moved
    return terms, at


def scanned(terms: Sequence[AxisCause], members: Sequence[int]) -> list[tuple[int, str]]:
    """Shapes of members that may have any value."""
    return [(i, name) for i in members for name in terms[i].scanned if terms[i].shape[name] > 0.0]


def jointly(
    data: ChannelData, terms: Sequence[AxisCause], members: Sequence[int], at: Sequence[Floats], sd: float,
    *, settings: bool = False,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Changes (d,) and standard deviations (d,) of amplitudes of members and of logarithms of their shapes.

    They are fitted jointly with healthy sizes under their priors. settings: jointly with other settings of switches, too,
    which come last.
    """
    names = scanned(terms, members)
    others = [(i, each) for i in members for each in terms[i].other_settings] if settings else []
    rows, values = {}, {}
    for k in data.train:

        def response(i: int, term: AxisCause, amount: Floats, k: int = k) -> Floats:
            return data.response(k, [(term, amount) if j == i else (terms[j], at[j]) for j in members])

        here = data.response(k, [(terms[j], at[j]) for j in members])
        own = [data.healthy_columns(k)]
        for i in members:
            for d in np.diag(STEP * np.maximum(np.abs(at[i]), 1.0)):
                own.append((response(i, terms[i], at[i] + d) - here)[:, None] / d.sum())
        for i, name in names:
            longer = replace(terms[i], shape={**terms[i].shape, name: terms[i].shape[name] * (1.0 + STEP)})
            own.append((response(i, longer, at[i]) - here)[:, None] / STEP)
        own += [(response(i, each, at[i]) - here)[:, None] for i, each in others]
        rows[k], values[k] = np.concatenate(own, axis=1), data.values[k] - here
    healthy, amplitudes = np.concatenate([*data.scales.values()]), sum(len(at[i]) for i in members)
    prior = np.concatenate([healthy, np.full(amplitudes, np.inf), np.full(len(names), SHAPE_SD), np.ones(len(others))])
    mean, covariance = shrunk(data.in_floors(rows), data.in_floors(values), prior, sd)
    return mean[len(healthy) :], np.sqrt(np.maximum(np.diag(covariance)[len(healthy) :], 0.0))


def misfit(
    data: ChannelData, terms: Sequence[AxisCause], members: Sequence[int], at: Sequence[Floats], sd: float
) -> float:
    """Sum of squares, prior included, that causes and healthy sizes leave of the fitted runs."""
    acting = [(terms[i], at[i]) for i in members]
    A = data.in_floors({k: data.healthy_columns(k) for k in data.train})
    y = data.in_floors({k: data.values[k] - data.response(k, acting) for k in data.train})
    prior = np.concatenate([*data.scales.values()])
    c, _ = shrunk(A, y, prior, sd)
    return float(np.sum((y - A @ c) ** 2) + sd**2 * np.sum((c / np.maximum(prior, 1e-30)) ** 2))


def covariate_ranges(data: ChannelData) -> dict[str, tuple[float, float]]:
    """Range of every covariate that moves in the fitted runs."""
    out = {}
    for name in data.covariates[0]:
        values = np.concatenate([data.covariates[k][name] for k in data.train])
        if np.ptp(values) > 0.0:
            out[name] = float(values.min()), float(values.max())
    return out
