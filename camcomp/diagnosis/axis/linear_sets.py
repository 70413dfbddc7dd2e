"""Sets of causes of a channel of an axis, each fitted by itself and made linear where it stands.

Responses of causes that act together are computed together. Shapes of causes (a speed, a dead time, a distance) are refined
jointly with the amplitudes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.special import softmax

from camcomp.diagnosis.axis.channel_data import ChannelData, shrunk
from camcomp.diagnosis.axis.effect_columns import AxisCause
from camcomp.diagnosis.axis.noise_floor import left_of_fit, noise_after_fit
from camcomp.diagnosis.model.candidates import AmplitudeBounds, Place, PlacedCause
from camcomp.diagnosis.model.discrepancy import covariate_columns, gains_of_more, smooth_functions
from camcomp.diagnosis.model.evidence import Background, LinearModel
from camcomp.diagnosis.model.explain import Explanation, posterior_of
from camcomp.diagnosis.model.group import Group
from camcomp.diagnosis.model.noise import MINOR, REPEATABILITY_MM
from camcomp.diagnosis.model.search import KEPT, ROUNDS, search_sets, sets_of_places
from camcomp.diagnosis.statistics.probability import EVEN
from camcomp.ground.datatypes import Floats, Ints

STEP = 1e-3  # of an amplitude in scales, for slopes
MOST_CHANGE = 0.7  # of the logarithm of a shape in one step
CAUSES = 3  # of one channel of one axis
SHAPE_SD = 1.5  # of the logarithm of a shape: scans of shapes span four
Acting = Sequence[tuple[AxisCause, Floats]]  # causes with their amplitudes (d,)


@dataclass(frozen=True, eq=False)
class LinearChannel:
    """A channel made linear at amplitudes of causes: columns (n, k) of these and the error of their tangents at 0 (n,), per run."""

    data: ChannelData
    acting: Acting
    responses: Sequence[tuple[Floats, Floats]]

    @staticmethod
    def at(data: ChannelData, acting: Acting) -> LinearChannel:
        """The channel at causes with their amplitudes."""
        here = data.where(acting)
        return LinearChannel(here, acting, [joint_columns(here, acting, k) for k in range(len(data.values))])

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
    def left(self) -> float:
        """The same where neighbouring rows say nothing of it."""
        return noise_after_fit(*self._columns, REPEATABILITY_MM)

    @property
    def _columns(self) -> tuple[Floats, Floats]:
        data = self.data
        A = data.in_floors({k: np.hstack((self.responses[k][0], data.healthy_columns(k))) for k in data.train})
        return A, data.in_floors({k: data.values[k] - self.responses[k][1] for k in data.train})

    def model(self, sd: float, places: int) -> LinearModel:
        """The linear model, with a deviation of a row that counts as one, and a number of places at which causes may act."""
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
        terms, start, placed = [term for term, _ in self.acting], 0, []
        for term in terms:
            columns = tuple(range(start, start := start + len(term.parameters)))
            placed.append(PlacedCause(*term.place, columns, term.ways))
        bounds = AmplitudeBounds.of(
            [p for t in terms for p in t.parameters], [bool(t.shape) for t in terms for _ in t.parameters]
        )
        return LinearModel(
            groups=tuple(groups), candidates=tuple(placed), bounds=bounds, healthy=dict.fromkeys(unit, 1.0),
            floors=sd / data.floor, places=places,
        )  # fmt: skip

    def explained(self, sd: float, places: int) -> LinearFit:
        """All of its causes, fitted with a deviation of a row."""
        model, every = self.model(sd, places), tuple(range(len(self.acting)))
        weighed = {every: max(model.reduced(Background()).value(every), -1e300)}
        return LinearFit(linear=self, found=posterior_of(model, {Background(): weighed}), sd=sd)


@dataclass(frozen=True, eq=False, kw_only=True)
class LinearFit:
    """A set of causes of a channel where it is made linear. sd: deviation of a row that counts as one.

    probability: of every place among all sets that were weighed.
    """

    linear: LinearChannel
    found: Explanation
    sd: float
    probability: Mapping[Place, float] = field(default_factory=dict)

    @property
    def data(self) -> ChannelData:
        """The channel with the healthy sizes beside these causes."""
        return self.linear.data

    @property
    def terms(self) -> list[AxisCause]:
        """Causes that act."""
        return [term for term, _ in self.linear.acting]

    @property
    def places(self) -> set[Place]:
        """Effects and targets of the causes."""
        return {term.place for term in self.terms}

    @property
    def refined(self) -> ChannelData:
        """The data with the noise of rows by what the fit says of them."""
        return self.data.refined(*self.residuals)

    @property
    def model(self) -> LinearModel:
        """The linear model."""
        return self.found.model

    @cached_property
    def unit(self) -> dict[str, Floats]:
        """Channel units per amplitude of its healthy columns (q,), by kind."""
        return self.data.scales

    @cached_property
    def amounts(self) -> list[Floats]:
        """Amplitudes (d,) of all terms."""
        return by_term(self.linear.acting, self.found.amplitudes()[0])

    @property
    def acting(self) -> list[tuple[AxisCause, Floats]]:
        """Causes that act, and their amplitudes (d,)."""
        return [*zip(self.terms, self.amounts, strict=True)]

    def again(self, sd: float, minor: frozenset[str] | None = None) -> LinearFit:
        """The fit of these causes where they stand, with another deviation of a row, or other kinds of minor sizes."""
        data = self.data if minor is None else replace(self.data, minor=minor)
        return LinearChannel.at(data, self.acting).explained(sd, self.model.places or 0)

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

    @cached_property
    def value(self) -> float:
        """Log evidence, with a function of one covariate where that adds to it."""
        gains = gains_of_more(self.model, self.found.background, self.found.members)
        return float(self.found.log_evidence + max(0.0, *gains.values()))

    @cached_property
    def excess(self) -> float:
        """Mean square of what causes and healthy sizes, but for those that are minor, leave of the fitted runs, each row over its
        noise.
        """
        data, (left, sizes) = self.data, self.residuals
        left = [y + sum(data.healthy[k][kind] @ sizes[kind] for kind in data.minor) for k, y in enumerate(left)]
        return float(np.mean(data.in_floors(dict(enumerate(left))) ** 2))

    @cached_property
    def residuals(self) -> tuple[list[Floats], dict[str, Floats]]:
        """Residuals (n,) per run, and healthy sizes by kind."""
        data, found, model = self.data, self.found, self.model
        mean = model.posterior(found.background, found.data.slab(found.members)).mean
        sizes = {kind: unit * mean[model.layout.covariates[kind]] for kind, unit in self.unit.items()}
        left = []
        for k, y in enumerate(data.values):
            healthy = sum((data.healthy[k][kind] @ sizes[kind] for kind in sizes), np.zeros(len(y)))
            left.append(y - data.response(k, self.acting) - healthy)
        return left, sizes


def most_probable(data: ChannelData, terms: Sequence[AxisCause]) -> LinearFit:
    """The most probable set of causes; every likely one is fitted by itself, with its own shapes, and made linear where it stands.

    The noise of rows is known by a first fit.
    """
    places = len({t.place for t in terms})
    linear = LinearChannel.at(data, [(t, np.zeros(len(t.parameters))) for t in terms]).with_misfit()
    sd = linear.noise
    sets = likely_sets(linear, sd, places)
    best = LinearChannel.at(linear.data, sets[0]).explained(sd, places)
    for _ in range(1 if data.clock == 0.0 else 2):
        data = best.refined
        channels = [settled(data, acting, sd) for acting in sets]
        best, sets = choose(channels, sd, places), [list(each.acting) for each in channels]
    return best


def choose(channels: Sequence[LinearChannel], sd: float, places: int) -> LinearFit:
    """The most probable of sets, with the smallest deviation of a row that any of them leaves, and sd at most.

    Parameters of the same causes are weighed by their evidence alone, causes jointly with a function of one covariate. A part of
    the best set takes its place where it is half as probable at least, or all else does no more than on healthy machines. The rows of
    a following error whose floor is not stated scatter by what the best set leaves, where that is less: neighbouring rows say more where
    the axis does not move evenly between them.
    """
    misfit = min(each.with_misfit().data.misfit for each in channels)
    channels = [replace(each, data=replace(each.data, misfit=misfit)) for each in channels]
    known = channels[0].data.stated or channels[0].data.channel != "following"
    sd = min(sd, *(each.noise if known else each.left for each in channels))
    every = sorted((each.explained(sd, places) for each in channels), key=lambda fit: fit.found.log_evidence)
    real = [f for f in every if all(a.any() and t.of_its_own for t, a in zip(f.terms, f.amounts, strict=True))]
    fits = [*{frozenset(fit.places): fit for fit in real}.values()]
    p = softmax([fit.value for fit in fits])
    best = fits[int(np.argmax(p))]
    while parts := [
        f for f in fits
        if f.places < best.places
        and (f.value > best.value + np.log(EVEN) or f.excess - best.excess < (MINOR * f.data.floor) ** 2)
    ]:  # fmt: skip
        best = max(parts, key=lambda fit: fit.value)
    own = {place: float(p[[place in fit.places for fit in fits]].sum()) for place in best.places}
    return replace(best, probability=own)


def likely_sets(linear: LinearChannel, sd: float, places: int) -> list[list[tuple[AxisCause, Floats]]]:
    """Sets of causes that are most probable by a channel made linear at none of them, with amplitudes to begin with.

    Of sets that differ in scanned shapes alone, the most probable one is among them, and all parts of the most probable set are.
    """
    terms = [term for term, _ in linear.acting]
    reduced = linear.model(sd, places).reduced(Background())
    weighed = search_sets(reduced, CAUSES)
    order = sorted(sets_of_places([t.place for t in terms], CAUSES), key=lambda m: -weighed.get(m, -np.inf))
    first = {tuple((terms[i].place, terms[i].parameters) for i in m): m for m in reversed(order)}
    ranked, out = sorted(first.values(), key=order.index), []
    for members in [m for k, m in enumerate(ranked) if k < KEPT or set(m) <= set(ranked[0])]:
        amount = np.zeros(sum(len(t.parameters) for t in terms))
        if members:
            amount[reduced.indices(members)] = reduced.estimate(members)[0]
        begun = by_term(linear.acting, amount)
        out.append([(terms[i], _begun(terms[i], begun[i])) for i in members])
    return out


def _begun(term: AxisCause, amount: Floats) -> Floats:
    """Amplitudes (d,) of a cause from which it is fitted: those of its guess where a tangent has the wrong sign."""
    wrong = any(p.sign * a < 0.0 for p, a in zip(term.parameters, amount, strict=True))
    return np.array(term.steps) if wrong and term.steps else amount


def settled(data: ChannelData, acting: Acting, sd: float) -> LinearChannel:
    """A set of causes with its shapes, made linear where it stands."""
    for _ in range(ROUNDS if acting else 0):
        data = data.where(acting)
        if (better := refined_shapes(data, acting, sd)) is acting:
            break
        acting = better
    return LinearChannel.at(data, acting)


def joint_columns(data: ChannelData, acting: Acting, k: int) -> tuple[Floats, Floats]:
    """Columns (n, k) of causes jointly with those that act, and the error of their tangents at 0 (n,)."""
    there = {i: each for i, each in enumerate(acting) if each[1].any()}
    here = data.response(k, [*there.values()])
    columns, offset = [np.zeros((len(here), 0))], here.copy()
    for i, (term, own) in enumerate(acting):
        first = np.array(term.steps or np.ones(len(own)))
        step = np.where(own == 0.0, first, STEP * np.maximum(np.abs(own), first))
        others = [each for j, each in there.items() if j != i]
        A = np.stack(
            [(data.response(k, [*others, (term, own + d)]) - here) / d[j] for j, d in enumerate(np.diag(step))], axis=1
        )
        columns.append(A)
        offset -= A @ own
    return np.concatenate(columns, axis=1), offset


def refined_shapes(data: ChannelData, acting: Acting, sd: float) -> Acting:
    """The causes after one Gauss-Newton step of amplitudes and shapes; the same ones where the step does not help."""
    base, (change, _) = misfit(data, acting, sd), jointly(data, acting, sd)
    for share in (1.0, 0.3, 0.1):
        moved = []
        for (term, own), step in zip(acting, by_cause(acting, share * change), strict=True):
            factors = np.exp(np.clip(step[len(own) :], -MOST_CHANGE, MOST_CHANGE)).tolist()
            shape = {
                name: term.bounded(name, term.shape[name] * by) for name, by in zip(term.free, factors, strict=True)
            }
            least = np.where([p.sign > 0 for p in term.parameters], 0.0, -np.inf)
            moved.append((replace(term, shape={**term.shape, **shape}), np.maximum(own + step[: len(own)], least)))
        if misfit(data, moved, sd) < base:
            return moved
    return acting


def by_term(acting: Acting, values: Floats) -> list[Floats]:
    """Values (..., k) of all amplitudes, of every cause by itself."""
    return np.split(values, np.cumsum([len(own) for _, own in acting])[:-1], axis=-1) if acting else []


def by_cause(acting: Acting, at: Floats) -> list[Floats]:
    """Values of amplitudes and free shapes (d,), of every cause by itself."""
    return np.split(at, np.cumsum([len(own) + len(term.free) for term, own in acting])[:-1]) if acting else []


def jointly(data: ChannelData, acting: Acting, sd: float) -> tuple[Floats, Floats]:
    """Changes (d,) and standard deviations (d,) of amplitudes and of logarithms of free shapes, cause by cause.

    They are fitted jointly with healthy sizes under their priors.
    """
    rows, values = {}, {}
    for k in data.train:
        here = data.response(k, acting)
        columns, amplitudes = [data.healthy_columns(k)], joint_columns(data, acting, k)[0]
        for i, ((term, own), A) in enumerate(zip(acting, by_term(acting, amplitudes), strict=True)):
            columns.append(A)
            for name in term.free:
                longer = replace(term, shape={**term.shape, name: term.shape[name] * (1.0 + STEP)})
                moved = data.response(k, [*acting[:i], (longer, own), *acting[i + 1 :]])
                columns.append((moved - here)[:, None] / STEP)
        rows[k], values[k] = np.concatenate(columns, axis=1), data.values[k] - here
    healthy = np.concatenate([*data.scales.values()])
    free = [np.repeat([np.inf, SHAPE_SD], [len(own), len(term.free)]) for term, own in acting]
    mean, covariance = shrunk(data.in_floors(rows), data.in_floors(values), np.concatenate([healthy, *free]), sd)
    return mean[len(healthy) :], np.sqrt(np.maximum(np.diag(covariance)[len(healthy) :], 0.0))


def misfit(data: ChannelData, acting: Acting, sd: float) -> float:
    """Sum of squares, prior included, that causes and healthy sizes leave of the fitted runs."""
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
