"""A channel of an axis by the model of every log: y = A a + N b + B w + e, a group per run.

A: columns of library effects. Sizes that every axis has (acceleration in a loop, Coulomb friction of a joint, weight by
angle, delay between two encoders) are shrunk, for axes move over a part of their travel in which these columns are nearly
the same. e has a memory: rows count as one per correlation length.

Source: Swevers, Verdonck, De Schutter, IEEE Control Systems 27 (2007) 58; shrinkage and choice: `camcomp.diagnosis.model`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.axis.channels import KNOWN
from camcomp.diagnosis.axis.effect_columns import AxisCause
from camcomp.diagnosis.axis.gate import MINOR
from camcomp.diagnosis.model.calibration import calibration_of
from camcomp.diagnosis.model.candidates import AmplitudeBounds, PlacedCause
from camcomp.diagnosis.model.discrepancy import covariate_columns, gains_of_more, smooth_functions
from camcomp.diagnosis.model.evidence import Background, LinearModel
from camcomp.diagnosis.model.explain import Explanation, posterior_of
from camcomp.diagnosis.model.group import Group
from camcomp.diagnosis.model.search import search_sets
from camcomp.diagnosis.result.types import Estimate, FoundCause
from camcomp.ground.datatypes import Floats

STEP = 1e-3  # of an amplitude in scales, for slopes
PASSES = 3  # in which columns are made linear again where the fit stands
MOST_CHANGE = 0.7  # of the logarithm of a shape in one step
CAUSES = 3  # of one channel of one axis
HEALTHY_SHARE = 0.3  # of the channel's size: scale of a size that every axis has
SHAPE_SD = 1.5  # of the logarithm of a shape: scans of shapes span four
Sizes = Mapping[str, Floats]  # kind -> columns (n, q)


@dataclass(frozen=True, eq=False, kw_only=True)
class ChannelData:
    """Rows of one channel, per run: values (n,), columns of healthy sizes, covariates (n,) of the dictionary.

    response: what causes with their amplitudes (d,) add to the channel of run k (n,). floor: noise of the channel. train: runs that are fitted.
    level: constant without a meaning.
    """

    values: Sequence[Floats]
    healthy: Sequence[Sizes]
    covariates: Sequence[Mapping[str, Floats]]
    response: Callable[[int, Sequence[tuple[AxisCause, Floats]]], Floats]
    floor: float
    train: Sequence[int]
    level: float = 0.0


@dataclass(frozen=True, eq=False, kw_only=True)
class ChannelFit:
    """What the model says of a channel: causes, healthy sizes by kind with their covariance, and residuals per run.

    acting: the causes with their amplitudes. drivers: covariate of the dictionary that is more likely than not -> share of the residual's energy.
    """

    causes: tuple[FoundCause, ...]
    acting: tuple[tuple[AxisCause, Floats], ...]
    sizes: Mapping[str, Floats]
    covariance: Floats
    left: Sequence[Floats]
    drivers: Mapping[str, float]

    def combined(self, weights: Mapping[str, Sequence[float]]) -> Estimate:
        """A sum of healthy sizes, by kind, with its 95 % interval."""
        w = np.concatenate(
            [np.asarray(weights.get(kind, np.zeros(len(own))), float) for kind, own in self.sizes.items()]
        )
        value = float(w @ np.concatenate([*self.sizes.values()]))
        half = 1.96 * float(np.sqrt(max(w @ self.covariance @ w, 0.0)))
        return _estimate(value, value - half, value + half)


@dataclass(frozen=True, eq=False)
class _Linear:
    model: LinearModel
    found: Explanation
    unit: Mapping[str, Floats]  # of healthy columns: channel units per amplitude of the model


def fit_channel(data: ChannelData, terms: Sequence[AxisCause]) -> ChannelFit:
    """The most probable causes of a channel, their sizes, and what is left."""
    at = [np.zeros(len(t.parameters)) for t in terms]
    for again in range(PASSES + 1):
        responses = [_columns(data, terms, k, at) for k in range(len(data.values))]
        sd = _noise(data, responses)
        linear = _explained(data, terms, responses, sd)
        members = linear.found.members
        amount = _amounts(linear, terms)
        moved = [amount[i] if i in members else np.zeros(len(t.parameters)) for i, t in enumerate(terms)]
        same = all(np.allclose(a, b, rtol=1e-3, atol=1e-6) for a, b in zip(at, moved, strict=True))
        if not members or same or again == PASSES:
            break
        terms, at = _shaped(data, terms, members, moved)
    return _answer(data, terms, linear, sd)


def healthy_sizes(columns: Sequence[Sizes], values: Sequence[Floats], floor: float) -> tuple[dict[str, Floats], Floats]:
    """Sizes by kind that every axis has in values (n,) per run, under their prior, with their covariance.

    floor: least noise of a row. The prior is that of `fit_channel`.
    """
    X = np.concatenate([np.concatenate([*own.values()], axis=1) for own in columns])
    y = np.concatenate([*values])
    rms = np.sqrt(np.mean(X**2, axis=0))
    scale = np.where(rms > 0.0, rms, 1.0)  # columns of zeros keep their prior
    X = X / scale
    left = y - X @ np.linalg.lstsq(X, y, rcond=1e-9)[0]
    sd = max(float(np.sqrt(np.mean(left**2) * rows_together(left))), floor)
    prior = max(HEALTHY_SHARE * float(np.sqrt(np.mean(y**2))), 1e-6 * sd)
    inverse = np.linalg.inv(X.T @ X / sd**2 + np.eye(X.shape[1]) / prior**2)
    mean = inverse @ (X.T @ y) / sd**2 / scale
    ends = np.cumsum([own.shape[1] for own in columns[0].values()])[:-1]
    return dict(zip(columns[0], np.split(mean, ends), strict=True)), inverse / np.outer(scale, scale)


def _columns(data: ChannelData, terms: Sequence[AxisCause], k: int, at: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Columns (n, k) of all terms beside those that act, and what their tangents miss at 0 (n,)."""
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


def _shaped(
    data: ChannelData, terms: Sequence[AxisCause], members: Sequence[int], at: Sequence[Floats]
) -> tuple[list[AxisCause], list[Floats]]:
    """Terms and amplitudes with the shapes of the causes that act by one Gauss-Newton step; as they are where it does not help."""
    names = [(i, name) for i in members for name in terms[i].scanned if terms[i].shape[name] > 0.0]
    terms, at = [*terms], [*at]
    if not names:
        return terms, at
    base = _misfit(data, terms, members, at)
    acting = [i for i in members]
    columns = [np.concatenate([*own.values()], axis=1) for own in data.healthy]
    slopes = []
    for k in data.train:
        here = data.response(k, [(terms[i], at[i]) for i in acting])
        own = [columns[k]]
        for i in acting:
            for d in np.diag(STEP * np.maximum(np.abs(at[i]), 1.0)):
                more = data.response(k, [(terms[j], at[j] + d if j == i else at[j]) for j in acting])
                own.append((more - here)[:, None] / d.sum())
        for i, name in names:
            longer = replace(terms[i], shape={**terms[i].shape, name: terms[i].shape[name] * (1.0 + STEP)})
            more = data.response(k, [(longer if j == i else terms[j], at[j]) for j in acting])
            own.append((more - here)[:, None] / STEP)
        slopes.append((np.concatenate(own, axis=1), data.values[k] - here))
    J, y = (np.concatenate([each[part] for each in slopes]) for part in (0, 1))
    size = np.sqrt(np.mean(J**2, axis=0)) + 1e-300
    c = (np.linalg.lstsq(J / size, y, rcond=1e-9)[0] / size)[columns[0].shape[1] :]
    for share in (1.0, 0.3, 0.1):
        moved, by, place = [*at], [*terms], 0
        for i in acting:
            moved[i] = at[i] + share * c[place : (place := place + len(at[i]))]
        for (i, name), change in zip(names, c[place:], strict=True):
            factor = float(np.exp(np.clip(share * change, -MOST_CHANGE, MOST_CHANGE)))
            by[i] = replace(by[i], shape={**by[i].shape, name: terms[i].bounded(name, by[i].shape[name] * factor)})
        if _misfit(data, by, members, moved) < base:
            return by, moved
    return terms, at


def _misfit(data: ChannelData, terms: Sequence[AxisCause], members: Sequence[int], at: Sequence[Floats]) -> float:
    """Sum of squares that causes and healthy sizes leave of the fitted runs."""
    A = np.concatenate([np.concatenate([*data.healthy[k].values()], axis=1) for k in data.train])
    acting = [(terms[i], at[i]) for i in members]
    y = np.concatenate([data.values[k] - data.response(k, acting) for k in data.train])
    size = np.sqrt(np.mean(A**2, axis=0)) + 1e-300
    return float(np.sum((y - A / size @ np.linalg.lstsq(A / size, y, rcond=1e-9)[0]) ** 2))


def _noise(data: ChannelData, responses: Sequence[tuple[Floats, Floats]]) -> float:
    """Standard deviation of a row that counts as one of its own, from residuals jointly with all columns.

    Rows that are correlated count for less: the variance is that of a row times the rows that count as one.
    """
    healthy = [np.concatenate([*own.values()], axis=1) for own in data.healthy]
    A = np.concatenate([np.concatenate([responses[k][0], healthy[k]], axis=1) for k in data.train])
    y = np.concatenate([data.values[k] - responses[k][1] for k in data.train])
    size = np.sqrt(np.mean(A**2, axis=0)) + 1e-300
    left = y - A / size @ np.linalg.lstsq(A / size, y, rcond=1e-9)[0]
    return max(float(np.sqrt(np.mean(left**2) * rows_together(left))), data.floor)


def _explained(
    data: ChannelData, terms: Sequence[AxisCause], responses: Sequence[tuple[Floats, Floats]],
    sd: float,
) -> _Linear:  # fmt: skip
    kinds = {kind: np.concatenate([data.healthy[k][kind] for k in data.train]) for kind in data.healthy[0]}
    unit = {kind: _shares(sd, np.sqrt(np.mean(own**2, axis=0))) for kind, own in kinds.items()}
    ends = _ends(data)
    groups = []
    for k in data.train:
        A, offset = responses[k]
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
                sd=np.full((n, 1), sd), B={**white, **smooth},
            )
        )  # fmt: skip
    start, placed = 0, []
    for term in terms:
        columns = tuple(range(start, start := start + len(term.parameters)))
        placed.append(PlacedCause(*term.place, columns, term.ways))
    bounds = AmplitudeBounds.of(
        [p for t in terms for p in t.parameters], [bool(t.shape) for t in terms for _ in t.parameters]
    )
    size = float(np.sqrt(np.mean(np.concatenate([data.values[k] for k in data.train]) ** 2)))
    model = LinearModel(
        groups=tuple(groups),
        candidates=tuple(placed),
        bounds=bounds,
        healthy=dict.fromkeys(kinds, max(HEALTHY_SHARE * size / sd, 1e-6)),
    )
    values = search_sets(model.reduced(Background()), CAUSES).values
    return _Linear(model, posterior_of(model, {Background(): values}), unit)


def _shares(sd: float, size: Floats) -> Floats:
    """Ratio of sd to the size of every column (k,); 0 for a column that is 0, as of an axis that stands still."""
    return np.divide(sd, size, out=np.zeros_like(size), where=size > 0.0)


def _ends(data: ChannelData) -> dict[str, tuple[float, float]]:
    """Range of every covariate that moves in the fitted runs."""
    out = {}
    for name in data.covariates[0]:
        values = np.concatenate([data.covariates[k][name] for k in data.train])
        if np.ptp(values) > 0.0:
            out[name] = float(values.min()), float(values.max())
    return out


def _amounts(linear: _Linear, terms: Sequence[AxisCause]) -> list[Floats]:
    mean = linear.found.amplitudes()[0]
    start, out = 0, []
    for term in terms:
        out.append(mean[start : (start := start + len(term.parameters))])
    return out


def _answer(data: ChannelData, terms: Sequence[AxisCause], linear: _Linear, sd: float) -> ChannelFit:
    found, model = linear.found, linear.model
    amount = _amounts(linear, terms)
    covariance = found.amplitudes()[1]
    at = model.posterior(found.background, found.data.slab(found.members))
    slots = {kind: np.arange(model.layout.size)[model.layout.covariates[kind]] for kind in linear.unit}
    sizes = {kind: unit * at.mean[slots[kind]] for kind, unit in linear.unit.items()}
    every, units = np.concatenate([*slots.values()]), np.concatenate([*linear.unit.values()])
    among = at.covariance(every.tolist()) * np.outer(units, units)
    left = []
    small = [at.mean[list(c.columns)] for c in model.candidates]
    amount = [a if i in found.members else small[i] for i, a in enumerate(amount)]
    for k, y in enumerate(data.values):
        part = data.response(k, [(t, a) for t, a in zip(terms, amount, strict=True) if a.any()])
        left.append(y - part - sum((data.healthy[k][kind] @ sizes[kind] for kind in sizes), np.zeros(len(y))))
    spreads = _spreads_of_shapes(data, terms, linear, amount)
    scale = calibration_of("axes")
    causes, acting = [], []
    whole = sum(float(np.sum((data.values[k] - data.level) ** 2)) for k in data.train)
    for i in found.members:
        term, columns = terms[i], list(model.candidates[i].columns)
        own = [data.response(k, [(term, amount[i])]) for k in data.train]
        if float(np.mean(np.concatenate(own) ** 2)) < (MINOR * data.floor) ** 2:
            continue  # as large as on every healthy machine
        less = sum(float(np.sum((left[k] + each) ** 2)) for k, each in zip(data.train, own, strict=True))
        rest = sum(float(np.sum(left[k] ** 2)) for k in data.train)
        half = 1.96 * scale.interval * np.sqrt(np.diag(covariance)[columns]) + KNOWN * np.abs(amount[i])
        acting.append((term, amount[i]))
        causes.append(
            FoundCause(
                effect=term.effect, target=term.target,
                probability=scale.calibrate(found.places[term.place]),
                share=round(min(max((less - rest) / max(whole, 1e-300), 0.0), 1.0), 4),
                parameters=_parameters(term, amount[i], half, spreads.get(i, {})),
            )
        )  # fmt: skip
    gains = gains_of_more(model, found.background, found.members)
    names = {b.scales[-1][0] for b, gain in gains.items() if b.scales and gain > 0.0}
    drivers = {name: _share_of(linear, name, [left[k] for k in data.train], sd) for name in names}
    return ChannelFit(
        causes=tuple(causes), acting=tuple(acting), sizes=sizes, covariance=among, left=left, drivers=drivers
    )


def _share_of(linear: _Linear, name: str, left: Sequence[Floats], sd: float) -> float:
    """Share of the energy of residuals (n,) that functions of a covariate take."""
    B = np.concatenate([g.B[name][:, 0, :] for g in linear.model.groups]) / sd
    y = np.concatenate(list(left))
    c = np.linalg.lstsq(B, y, rcond=1e-9)[0]
    return float(np.clip(1.0 - np.sum((y - B @ c) ** 2) / max(float(np.sum(y**2)), 1e-300), 0.0, 1.0))


def _parameters(term: AxisCause, amount: Floats, half: Floats, spreads: Mapping[str, float]) -> dict[str, Estimate]:
    """Parameters as the effect's file has them; shapes that were fitted with the deviation of a fit around them."""
    out: dict[str, Estimate] = {}
    values = term.cause(amount.tolist()).values
    for p, a, h in zip(term.parameters, amount.tolist(), half.tolist(), strict=True):
        low, value, high = (p.value(each * p.scale) for each in (a - h, a, a + h))
        if p.name in values:
            out[p.name] = _estimate(value, low, high)
    for name in [each for each in term.shape if each in values and each not in term.switches]:
        value = term.shape[name]
        if name in term.known:
            low, high = value - term.known[name], value + term.known[name]
        else:
            factor = float(np.exp(1.96 * float(np.hypot(spreads[name], KNOWN))))
            low, high = value / factor, value * factor
        out[name] = _estimate(value, low, high)
    return out


def _spreads_of_shapes(
    data: ChannelData, terms: Sequence[AxisCause], linear: _Linear, amount: Sequence[Floats]
) -> dict[int, dict[str, float]]:
    """Standard deviations of logarithms of shapes by term, jointly with amplitudes and healthy sizes under their priors."""
    members, model = linear.found.members, linear.model
    names = [(i, name) for i in members for name in terms[i].scanned]
    if not names:
        return {}
    acting = {i: (terms[i], amount[i]) for i in members}
    slopes = []
    for k in data.train:
        own = []
        for i, name in names:
            both = [
                replace(terms[i], shape={**terms[i].shape, name: terms[i].shape[name] * (1.0 + e * STEP)})
                for e in (1, -1)
            ]
            ends = [data.response(k, [*{**acting, i: (each, amount[i])}.values()]) for each in both]
            own.append((ends[0] - ends[1]) / (2.0 * STEP))
        slopes.append(np.stack(own, axis=1))
    columns = [j for i in members for j in model.candidates[i].columns]
    healthy = [j for kind in linear.unit for j in range(*model.layout.covariates[kind].indices(model.layout.size))]
    designs = [model.layout.design(g)[:, 0, [*columns, *healthy]] for g in model.groups]
    J = np.concatenate([np.hstack(pair) for pair in zip(slopes, designs, strict=True)]) / model.groups[0].sd[0, 0]
    prior = np.zeros(J.shape[1])
    prior[: len(names)] = SHAPE_SD**-2
    prior[len(names) + len(columns) :] = 1.0 / next(iter(model.healthy.values())) ** 2
    size = np.sqrt(np.sum(J**2, axis=0) + prior) + 1e-300
    inverse = np.linalg.pinv((J / size).T @ (J / size) + np.diag(prior / size**2), rcond=1e-9)
    out: dict[int, dict[str, float]] = {}
    for place, (i, name) in enumerate(names):
        out.setdefault(i, {})[name] = float(np.sqrt(max(inverse[place, place], 0.0)) / size[place])
    return out


def _estimate(value: float, low: float, high: float) -> Estimate:
    low, value, high = (float(f"{each:.6g}") for each in (low, value, high))
    return Estimate(value=value, ci95=(min(low, value), max(high, value)))


def rows_together(left: Floats) -> float:
    """Rows that count as one: the integral of the autocorrelation of residuals (n,) up to its first zero, both ways."""
    centred = left - left.mean()
    n = len(centred)
    power = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    rho = np.fft.irfft(power)[:n]
    rho = rho / max(float(rho[0]), 1e-300)
    ends = np.flatnonzero(rho <= 0.0)
    return float(1.0 + 2.0 * rho[1 : ends[0] if len(ends) else n].sum())
