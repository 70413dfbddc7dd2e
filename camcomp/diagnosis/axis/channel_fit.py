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
CAUSES = 3  # of one channel of one axis
HEALTHY_SHARE = 0.3  # of the channel's size: scale of a size that every axis has
LEAST_MEANS = 40  # of all rows: fewer do not carry a fit
Sizes = Mapping[str, Floats]  # kind -> columns (n, q)


@dataclass(frozen=True, eq=False, kw_only=True)
class ChannelData:
    """Rows of one channel, per run: values (n,), columns of healthy sizes, covariates (n,) of the dictionary.

    response: what a cause adds to the channel of run k (n,). floor: noise of the channel. train: runs that are fitted.
    level: constant without a meaning.
    """

    values: Sequence[Floats]
    healthy: Sequence[Sizes]
    covariates: Sequence[Mapping[str, Floats]]
    response: Callable[[int, AxisCause, Sequence[float]], Floats]
    floor: float
    train: Sequence[int]
    level: float = 0.0


@dataclass(frozen=True, eq=False)
class ChannelFit:
    """What the model says of a channel: causes, healthy sizes by kind with their covariance, and residuals per run.

    drivers: covariate of the dictionary that is more likely than not -> share of the residual's energy.
    """

    causes: tuple[FoundCause, ...]
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
    responses = [_columns(data, terms, k, at) for k in range(len(data.values))]
    sd, together = _noise(data, [A for A, _ in responses])
    linear = _explained(data, terms, responses, sd, together)
    for _ in range(PASSES):
        members = linear.found.members
        if not members:
            break
        amount = _amounts(linear, terms)
        moved = [amount[i] if i in members else np.zeros(len(t.parameters)) for i, t in enumerate(terms)]
        if all(np.allclose(a, b, rtol=1e-3, atol=1e-6) for a, b in zip(at, moved, strict=True)):
            break
        at = moved
        responses = [_columns(data, terms, k, at) for k in range(len(data.values))]
        linear = _explained(data, terms, responses, sd, together)
    return _answer(data, terms, linear, sd, together)


def _columns(data: ChannelData, terms: Sequence[AxisCause], k: int, at: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Columns (n, k) of all terms at amplitudes, and what their tangents miss at 0 (n,)."""
    n = len(data.values[k])
    columns, offset = [np.zeros((n, 0))], np.zeros(n)
    for term, own in zip(terms, at, strict=True):
        here = data.response(k, term, own.tolist())
        step = np.where(own == 0.0, 1.0, STEP * np.maximum(np.abs(own), 1.0))
        A = np.stack(
            [(data.response(k, term, (own + d).tolist()) - here) / d[i] for i, d in enumerate(np.diag(step))], axis=1
        )
        columns.append(A)
        offset += here - A @ own
    return np.concatenate(columns, axis=1), offset


def _noise(data: ChannelData, columns: Sequence[Floats]) -> tuple[float, int]:
    """Standard deviation of the mean of rows that count as one, and how many these are, from residuals beside all columns."""
    healthy = [np.concatenate([*own.values()], axis=1) for own in data.healthy]
    A = np.concatenate([np.concatenate([columns[k], healthy[k]], axis=1) for k in data.train])
    y = np.concatenate([data.values[k] for k in data.train])
    size = np.sqrt(np.mean(A**2, axis=0)) + 1e-300
    left = y - A / size @ np.linalg.lstsq(A / size, y, rcond=1e-9)[0]
    together = int(max(min(rows_together(left), len(left) / LEAST_MEANS), 1.0))
    means = block_means(left[:, None], together)[:, 0]
    sd = max(float(np.sqrt(np.mean(means**2))), data.floor / float(np.sqrt(together)))
    return sd * float(np.sqrt(rows_together(means))), together


def _explained(
    data: ChannelData, terms: Sequence[AxisCause], responses: Sequence[tuple[Floats, Floats]],
    sd: float, together: int,
) -> _Linear:  # fmt: skip
    def means(columns: Floats) -> Floats:
        return block_means(columns, together)[:, None, :]

    kinds = {kind: np.concatenate([data.healthy[k][kind] for k in data.train]) for kind in data.healthy[0]}
    unit = {kind: sd / (np.sqrt(np.mean(own**2, axis=0)) + 1e-300) for kind, own in kinds.items()}
    ends = _ends(data)
    groups = []
    for k in data.train:
        A, offset = responses[k]
        y = means((data.values[k] - offset)[:, None])
        n = len(y)
        white = {kind: means(own * unit[kind]) for kind, own in data.healthy[k].items()}
        smooth = {
            name: covariate_columns(means(smooth_functions(own, *ends[name]))[:, 0], np.full((n, 1, 1), sd))
            for name, own in data.covariates[k].items() if name in ends
        }  # fmt: skip
        groups.append(
            Group(
                name=str(k), label="axis", y=y[:, :, 0], A=means(A), N=np.zeros((n, 1, 0)),
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
        tuple(groups), tuple(placed), bounds, healthy=dict.fromkeys(kinds, max(HEALTHY_SHARE * size / sd, 1e-6))
    )
    values = search_sets(model.reduced(Background()), CAUSES).values
    return _Linear(model, posterior_of(model, {Background(): values}), unit)


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


def _answer(data: ChannelData, terms: Sequence[AxisCause], linear: _Linear, sd: float, together: int) -> ChannelFit:
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
        part = sum(
            (data.response(k, t, a.tolist()) for t, a in zip(terms, amount, strict=True) if a.any()), np.zeros(len(y))
        )
        left.append(y - part - sum((data.healthy[k][kind] @ sizes[kind] for kind in sizes), np.zeros(len(y))))
    scale = calibration_of("axes")
    causes = []
    whole = sum(float(np.sum((data.values[k] - data.level) ** 2)) for k in data.train)
    for i in found.members:
        term, columns = terms[i], list(model.candidates[i].columns)
        own = [data.response(k, term, amount[i].tolist()) for k in data.train]
        less = sum(float(np.sum((left[k] + each) ** 2)) for k, each in zip(data.train, own, strict=True))
        rest = sum(float(np.sum(left[k] ** 2)) for k in data.train)
        half = 1.96 * scale.interval * np.sqrt(np.diag(covariance)[columns]) + KNOWN * np.abs(amount[i])
        causes.append(
            FoundCause(
                effect=term.effect, target=term.target,
                probability=scale.calibrate(found.places[term.place]),
                share=round(min(max((less - rest) / max(whole, 1e-300), 0.0), 1.0), 4),
                parameters=_parameters(data, term, amount[i], half, sd * together**0.5),
            )
        )  # fmt: skip
    gains = gains_of_more(model, found.background, found.members)
    names = {b.scales[-1][0] for b, gain in gains.items() if b.scales and gain > 0.0}
    kept = [block_means(left[k][:, None], together)[:, 0] for k in data.train]
    drivers = {name: _share_of(linear, name, kept, sd) for name in names}
    return ChannelFit(
        tuple(causes), sizes, among, left, drivers
    )  # fmt: skip


def _share_of(linear: _Linear, name: str, left: Sequence[Floats], sd: float) -> float:
    """Share of the energy of residuals (n,) that functions of a covariate take."""
    B = np.concatenate([g.B[name][:, 0, :] for g in linear.model.groups]) / sd
    y = np.concatenate(list(left))
    c = np.linalg.lstsq(B, y, rcond=1e-9)[0]
    return float(np.clip(1.0 - np.sum((y - B @ c) ** 2) / max(float(np.sum(y**2)), 1e-300), 0.0, 1.0))


def _parameters(data: ChannelData, term: AxisCause, amount: Floats, half: Floats, sd: float) -> dict[str, Estimate]:
    """Parameters as the effect's file has them; shapes that were fitted with the deviation of a fit around them."""
    out: dict[str, Estimate] = {}
    values = term.cause(amount.tolist()).values
    for p, a, h in zip(term.parameters, amount.tolist(), half.tolist(), strict=True):
        low, value, high = (p.value(each * p.scale) for each in (a - h, a, a + h))
        if p.name in values:
            out[p.name] = _estimate(value, low, high)
    for name in [each for each in term.shape if each in values and each not in term.switches]:
        value, spread = term.shape[name], 1.96 * _spread_of_shape(data, term, amount, name, sd)
        near = [abs(each - value) for each in term.scan if each != value]
        low, high = (max(value + sign * max(spread, min(near, default=term.resolution)), 0.0) for sign in (-1.0, 1.0))
        out[name] = _estimate(value, low, high)
    return out


def _spread_of_shape(data: ChannelData, term: AxisCause, amount: Floats, name: str, sd: float) -> float:
    """Standard deviation of a shape from the slopes of all shapes of its cause together."""
    names = list(term.shape)
    columns = []
    for each in names:
        step = max(STEP * abs(term.shape[each]), 1e-9)
        ends = [replace(term, shape={**term.shape, each: term.shape[each] + sign * step}) for sign in (-1.0, 1.0)]
        slopes = [
            (data.response(k, ends[1], amount.tolist()) - data.response(k, ends[0], amount.tolist())) / (2.0 * step)
            for k in data.train
        ]
        columns.append(np.concatenate(slopes))
    J = np.stack(columns, axis=1)
    size = np.sqrt(np.mean(J**2, axis=0)) + 1e-300
    inverse = np.linalg.pinv((J / size).T @ (J / size), rcond=1e-9)
    i = names.index(name)
    return float(sd * np.sqrt(inverse[i, i]) / size[i]) if size[i] > 1e-200 else 0.0


def _estimate(value: float, low: float, high: float) -> Estimate:
    low, value, high = (float(f"{each:.6g}") for each in (low, value, high))
    return Estimate(value=value, ci95=(min(low, value), max(high, value)))


def block_means(columns: Floats, together: int) -> Floats:
    """Means (n / together, q) of rows that follow each other; what is over at the end counts as a block of its own."""
    if together == 1:
        return columns
    starts = np.arange(0, len(columns), together)
    return np.asarray(np.add.reduceat(columns, starts, axis=0) / np.diff(np.append(starts, len(columns)))[:, None])


def rows_together(left: Floats) -> float:
    """Rows that count as one: the integral of the autocorrelation of residuals (n,) up to its first zero, both ways."""
    centred = left - left.mean()
    n = len(centred)
    power = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    rho = np.fft.irfft(power)[:n]
    rho = rho / max(float(rho[0]), 1e-300)
    ends = np.flatnonzero(rho <= 0.0)
    return float(1.0 + 2.0 * rho[1 : ends[0] if len(ends) else n].sum())
