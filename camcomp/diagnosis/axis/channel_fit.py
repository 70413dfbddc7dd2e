"""A channel of an axis by the model of every log: y = A a + N b + B w + e, a group per run.

A: columns of library effects. Sizes that every axis has (acceleration in a loop, Coulomb friction of a joint, weight by
angle, delay between two encoders) are shrunk, for axes move over a part of their travel in which these columns are nearly
the same. e has a memory: rows count as one per correlation length.

Source: Swevers, Verdonck, De Schutter, IEEE Control Systems 27 (2007) 58; shrinkage and choice: `camcomp.diagnosis.model`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from camcomp.diagnosis.axis.at_tip import lever_mm
from camcomp.diagnosis.axis.channel_data import ACCELERATION, BEYOND, ChannelData
from camcomp.diagnosis.axis.effect_columns import AxisCause
from camcomp.diagnosis.axis.gate import KNOWN, LOCAL
from camcomp.diagnosis.axis.linear_sets import (
    CAUSES,
    PASSES,
    LinearFit,
    by_term,
    covariate_ranges,
    explained,
    joint_columns,
    jointly,
    noise_of_rows,
    refined_shapes,
    residuals,
    scanned,
    settled,
    with_misfit,
)
from camcomp.diagnosis.axis.row_noise import noise_after_fit
from camcomp.diagnosis.model.calibration import calibration_of
from camcomp.diagnosis.model.discrepancy import gains_of_more, prior_of_covariate, smooth_functions
from camcomp.diagnosis.model.imitation import probability_with_unmodelled, products_across
from camcomp.diagnosis.model.noise import MINOR
from camcomp.diagnosis.model.search import ROUNDS, sets_of_places
from camcomp.diagnosis.result.types import Estimate, FoundCause
from camcomp.ground.datatypes import Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class ChannelFit:
    """The model of a channel: causes, healthy sizes by kind with their covariance, and residuals per run.

    acting: the causes with their amplitudes. columns (n, k): of these and the healthy sizes, of the fitted runs. drivers:
    covariate of the dictionary that is more likely than not -> share of the residual's energy. hints: the same, where nothing
    but such functions makes rows of the residual alike.
    imitated: probability of every cause where the residual shows something unmodelled. unmodelled: kinds of healthy sizes that
    are larger than on healthy machines, with their share of the channel's energy, and the log odds that no cause does the same.
    """

    causes: tuple[FoundCause, ...]
    acting: tuple[tuple[AxisCause, Floats], ...]
    sizes: Mapping[str, Floats]
    covariance: Floats
    left: Sequence[Floats]
    columns: Floats
    drivers: Mapping[str, float]
    hints: Mapping[str, float]
    imitated: tuple[float, ...]
    unmodelled: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def combined(self, weights: Mapping[str, Sequence[float]]) -> Estimate:
        """A sum of healthy sizes, by kind, with its 95 % interval."""
        w = np.concatenate(
            [np.asarray(weights.get(kind, np.zeros(len(own))), float) for kind, own in self.sizes.items()]
        )
        value = float(w @ np.concatenate([*self.sizes.values()]))
        half = 1.96 * float(np.sqrt(max(w @ self.covariance @ w, 0.0)))
        return Estimate.stated(value, value - half, value + half)


@dataclass(frozen=True, eq=False)
class _Fit:
    """The most probable set of causes under a prior of the healthy sizes; sd: deviation of a row that counts as one."""

    data: ChannelData
    terms: Sequence[AxisCause]
    linear: LinearFit
    sd: float

    def log_evidence(self, sd: float) -> float:
        """Log evidence of the set where it stands, with another deviation of a row."""
        amount, members = by_term(self.linear.found.amplitudes()[0], self.terms), self.linear.found.members
        return settled(self.data, self.terms, amount, on=members, sd=sd).found.log_evidence


def fit_channel(data: ChannelData, terms: Sequence[AxisCause]) -> ChannelFit:
    """The most probable causes of a channel, their sizes and the residual.

    Healthy sizes of a following error that are larger than on healthy machines are unmodelled, as functions of a covariate are.
    That of the acceleration is weighed against causes beside which it is not; what is left below the floor is none.
    """
    free = _most_probable(data, terms)
    large = _large(free) if data.channel == "following" else {}
    if ACCELERATION in large:
        minor = _most_probable(replace(data, minor=frozenset({ACCELERATION})), terms)
        sd = min(free.sd, minor.sd)
        at_floor = _excess(minor.terms, minor.linear) <= data.floor**2
        if at_floor or free.log_evidence(sd) + prior_of_covariate(free.linear.model) < minor.log_evidence(sd):
            free, large = minor, {kind: own for kind, own in _large(minor).items() if kind != ACCELERATION}
    return replace(_answer(free), unmodelled=large)


def _large(fit: _Fit) -> dict[str, tuple[float, float]]:
    """Kinds of healthy sizes that are more than minor: share of the channel's energy, and log odds that they are."""
    data = fit.data
    out: dict[str, tuple[float, float]] = {}
    sizes = residuals(fit.terms, fit.linear)[2]
    whole = float(np.mean(np.concatenate([data.values[k] for k in data.train]) ** 2))
    for kind in (each for each in BEYOND if each in sizes):
        square = float(np.mean(np.concatenate([data.healthy[k][kind] @ sizes[kind] for k in data.train]) ** 2))
        if square > data.minor_size(kind) ** 2:
            minor = replace(fit, data=replace(data, minor=data.minor | {kind}))
            gain = fit.log_evidence(fit.sd) - minor.log_evidence(fit.sd) + prior_of_covariate(fit.linear.model)
            out |= {kind: (min(square / whole, 1.0), gain)} if gain > 0.0 else {}
    return out


def _most_probable(data: ChannelData, terms: Sequence[AxisCause]) -> _Fit:
    at = [np.zeros(len(t.parameters)) for t in terms]
    for again in range(PASSES + 1):
        data = data.where(terms, at)
        responses = [joint_columns(data, terms, k, at) for k in range(len(data.values))]
        data = with_misfit(data, responses)
        sd = noise_of_rows(data, responses)
        linear = explained(data, terms, responses, sd)
        members = linear.found.members
        amount = by_term(linear.found.amplitudes()[0], terms)
        moved = [amount[i] if i in members else np.zeros(len(t.parameters)) for i, t in enumerate(terms)]
        same = all(np.allclose(a, b, rtol=1e-3, atol=1e-6) for a, b in zip(at, moved, strict=True))
        late = data.clock > 0.0 and again == 0  # rows may be late without any cause, too
        if again == PASSES or (not late and (same or not members)):
            break
        left, _, sizes = residuals(terms, linear)
        data = data.refined(left, sizes)
        terms, at = refined_shapes(data, terms, members, moved, sd)
    if data.channel == "following" and _excess(terms, linear) > LOCAL * data.floor**2:
        terms, linear, sd = _among_every_set(data, terms)
        data = linear.data
    terms, linear = _without_needless_parameters(data, terms, linear, sd)
    return _Fit(data, *_without_needless(data, terms, linear, sd), sd)


def _excess(terms: Sequence[AxisCause], linear: LinearFit) -> float:
    """Mean square of what causes and healthy sizes, but for those that are minor, leave of the fitted runs, each row over its
    noise.
    """
    data, (left, _, sizes) = linear.data, residuals(terms, linear, small=False)
    left = [y + sum(data.healthy[k][kind] @ sizes[kind] for kind in data.minor) for k, y in enumerate(left)]
    return float(np.mean(data.in_floors(dict(enumerate(left))) ** 2))


def _among_every_set(data: ChannelData, terms: Sequence[AxisCause]) -> tuple[Sequence[AxisCause], LinearFit, float]:
    """The most probable of all sets of causes of a loop, each with its own shapes and made linear where it stands.

    Loops of one axis are much alike as long as they are linear, so that steps from one set do not lead to every other. With the
    deviation of a row that the best of them leaves.
    """
    fits = {}
    for on in sets_of_places([t.place for t in terms], CAUSES):
        at = [np.zeros(len(t.parameters)) for t in terms]
        linear, by = settled(data, terms, at, on=on, sd=data.floor, passes=1), [*terms]
        amount = by_term(linear.found.amplitudes()[0], terms)
        at = [_begun(terms[i], amount[i]) if i in on else each for i, each in enumerate(at)]
        for _ in range(ROUNDS):
            by, at = refined_shapes(data.where(by, at), by, on, at, data.floor)
        here = data.where(by, at)
        responses = [joint_columns(here, by, k, at) for k in range(len(data.values))]
        fits[on] = by, here, responses, noise_of_rows(here, responses)
    sd = min(noise for *_, noise in fits.values())
    linear_of = {on: explained(here, by, responses, sd, on) for on, (by, here, responses, _) in fits.items()}
    best = max(fits, key=lambda on: _value(linear_of[on]))
    return fits[best][0], linear_of[best], sd


def _begun(term: AxisCause, amount: Floats) -> Floats:
    """Amplitudes (d,) of a cause from which it is fitted: those of its guess where a tangent has the wrong sign."""
    wrong = any(p.sign * a < 0.0 for p, a in zip(term.parameters, amount, strict=True))
    return np.array(term.steps) if wrong and term.steps else amount


def _value(fit: LinearFit) -> float:
    """Log evidence of a fit, with a function of one covariate where that adds to it."""
    found = fit.found
    gains = gains_of_more(fit.model, found.background, found.members)
    return float(found.log_evidence + max(0.0, *gains.values()))


def _without_needless(
    data: ChannelData, terms: Sequence[AxisCause], linear: LinearFit, sd: float
) -> tuple[Sequence[AxisCause], LinearFit]:
    """The fit without causes that the others, or a function of one covariate, explain as well.

    Sets are made linear where they stand. A cause goes, too, where it is as large as on every healthy machine.
    """
    while linear.found.members:
        own = [terms[i] for i in linear.found.members]
        amount = by_term(linear.found.amplitudes()[0], terms)
        at = [amount[i] for i in linear.found.members]
        every = tuple(range(len(own)))
        sets = [every, *(tuple(i for i in every if i != out) for out in every)]
        fits = {on: settled(data, own, at, on=on, sd=sd) for on in sets}
        value = {on: _value(fit) for on, fit in fits.items()}
        best = max(sets[1:], key=lambda on: value[on])
        more = _excess(own, fits[best]) - _excess(own, fits[every])
        if value[best] < value[every] and more > (MINOR * data.floor) ** 2:
            break
        terms, linear = own, fits[best]
    return terms, linear


def _without_needless_parameters(
    data: ChannelData, terms: Sequence[AxisCause], linear: LinearFit, sd: float
) -> tuple[Sequence[AxisCause], LinearFit]:
    """The fit with the causes of fewer parameters that are more probable where they stand, as the linear ones did not show."""
    every = tuple(range(len(linear.found.members)))
    by, fit = terms, linear
    while True:
        amount, own = by_term(fit.found.amplitudes()[0], by), [by[i] for i in fit.found.members]
        at = [amount[i] for i in fit.found.members]
        options = _with_fewer_parameters(own, at, terms)
        if not options:
            return by, fit
        shaped = [(own, at), *(refined_shapes(data, less, every, begun, sd) for less, begun in options)]
        fits = [settled(data, each, begun, on=every, sd=sd) for each, begun in shaped]
        best = max(range(len(fits)), key=lambda k: fits[k].found.log_evidence)
        if best == 0:
            return by, fit
        by, fit = shaped[best][0], fits[best]


def _with_fewer_parameters(
    own: Sequence[AxisCause], at: Sequence[Floats], terms: Sequence[AxisCause]
) -> list[tuple[list[AxisCause], list[Floats]]]:
    """Causes and amplitudes with one of them replaced by a candidate of its place that lacks parameters of it."""
    out = {}
    for i, term in enumerate(own):
        names = [p.name for p in term.parameters]
        for other in terms:
            less = [p.name for p in other.parameters]
            if other.place == term.place and set(less) < set(names) and set(other.shape) <= set(term.shape):
                by = replace(other, shape={key: term.shape[key] for key in other.shape})
                kept = at[i][[names.index(name) for name in less]]
                out[i, *less] = [*own[:i], by, *own[i + 1 :]], [*at[:i], kept, *at[i + 1 :]]
    return list(out.values())


def _answer(fit: _Fit) -> ChannelFit:
    terms, linear, sd = fit.terms, fit.linear, fit.sd
    data, found, model = linear.data, linear.found, linear.model
    deviation = by_term(np.sqrt(np.diag(found.amplitudes()[1])), terms)
    at = model.posterior(found.background, found.data.slab(found.members))
    slots = {kind: np.arange(model.layout.size)[model.layout.covariates[kind]] for kind in linear.unit}
    every, units = np.concatenate([*slots.values()]), np.concatenate([*linear.unit.values()])
    among = at.covariance(every.tolist()) * np.outer(units, units)
    left, amount, sizes = residuals(terms, linear)
    spreads = _spreads_of_shapes(data, terms, linear, amount, sd)
    scale = calibration_of("axes")
    causes, acting, imitated, train = [], [], [], [left[k] for k in data.train]
    gains = _gains_of_functions(data, linear, left, sd)
    whole = sum(float(np.sum((data.values[k] - data.level) ** 2)) for k in data.train)
    for i in found.members:
        term = terms[i]
        own = [data.response(k, [(term, amount[i])]) for k in data.train]
        if float(np.mean(np.concatenate(own) ** 2)) < (MINOR * data.floor) ** 2:
            continue  # as large as on every healthy machine
        less = sum(float(np.sum((left[k] + each) ** 2)) for k, each in zip(data.train, own, strict=True))
        rest = sum(float(np.sum(left[k] ** 2)) for k in data.train)
        half = 1.96 * scale.interval * deviation[i] + KNOWN * np.abs(amount[i])
        acting.append((term, amount[i]))
        imitated.append(
            _no_imitation(
                data, terms, linear, i, effect=np.concatenate(own), left=np.concatenate(train), gains=gains[1], sd=sd
            )
        )
        causes.append(
            FoundCause(
                effect=term.effect, target=term.target,
                probability=scale.calibrate(found.places[term.place]),
                share=round(min(max((less - rest) / max(whole, 1e-300), 0.0), 1.0), 4),
                parameters=_parameters(term, amount[i], half, spreads.get(i, {})),
            )
        )  # fmt: skip
    drivers, hints = ({n: _share_of(linear, n, train, sd) for n, gain in each.items() if gain > 0.0} for each in gains)
    return ChannelFit(
        causes=tuple(causes), acting=tuple(acting), sizes=sizes, covariance=among, left=left, drivers=drivers,
        hints=hints, columns=_design(linear), imitated=tuple(imitated),
    )  # fmt: skip


def _no_imitation(
    data: ChannelData,
    terms: Sequence[AxisCause],
    linear: LinearFit,
    i: int,
    *,
    effect: Floats,
    left: Floats,
    gains: Mapping[str, float],
    sd: float,
) -> float:
    """Probability of a member with an effect (n,), where the excess of the residual (n,) over the floor is unmodelled for
    certain.
    """
    found, term = linear.found, terms[i]
    others = tuple(j for j in found.members if j != i)
    alike = 1.0 if term.run else term.ways  # shapes of one cause, but windows, are imitated together
    design = _design(linear, i)
    functions = {
        name: (gains.get(name, 0.0), products_across(effect, design, own, sd)) for name, own in _functions(data).items()
    }
    return probability_with_unmodelled(
        float(np.sqrt(np.mean(effect**2))), functions, rows=len(effect),
        excess=float(np.sqrt(max(float(np.mean(left**2)) - data.floor**2, 0.0))), floor=data.floor,
        odds=found.data.prior(found.members) - found.data.prior(others) + float(np.log(alike)),
    )  # fmt: skip


def _functions(data: ChannelData) -> dict[str, Floats]:
    """Functions (n, q) of every covariate in the rows of the fitted runs."""
    return {
        name: np.concatenate([smooth_functions(data.covariates[k][name], *ends) for k in data.train])
        for name, ends in covariate_ranges(data).items()
    }


def _design(linear: LinearFit, without: int | None = None) -> Floats:
    """Columns (n, k) of the causes that act, but for one, and of healthy sizes, in all rows that were fitted, per standard
    deviation of their amplitudes before the data.
    """
    model, slab = linear.model, linear.found.data.slab(linear.found.members)
    slots = [j for kind in linear.unit for j in range(*model.layout.covariates[kind].indices(model.layout.size))]
    members = (i for i in linear.found.members if i != without)
    on = [*(j for i in members for j in model.candidates[i].columns), *slots]
    width = np.array([slab.get(j, 1.0) for j in on])
    return np.asarray(np.concatenate([model.layout.design(g)[:, 0, on] for g in model.groups]) * width, float)


def _gains_of_functions(
    data: ChannelData, linear: LinearFit, left: Sequence[Floats], sd: float
) -> tuple[dict[str, float], dict[str, float]]:
    """Log Bayes factor of a function of every covariate for the residual (n,), priors included, and the same where the
    noise is what these functions leave.
    """
    found, model = linear.found, linear.model
    y, light = (data.in_floors(dict(enumerate(each))) for each in (left, [np.ones(len(own)) for own in left]))
    B = np.hstack([np.zeros((len(y), 0)), *_functions(data).values()]) * light[:, None]
    rest = noise_after_fit(B, y, data.floor)
    out = []
    for factor in (1.0, min(rest / sd, 1.0)):
        best: dict[str, float] = {}
        for b, gain in gains_of_more(model, replace(found.background, noise=factor), found.members).items():
            if b.scales:
                best[b.scales[-1][0]] = max(gain, best.get(b.scales[-1][0], -np.inf))
        out.append(best)
    return out[0], out[1]


def _share_of(linear: LinearFit, name: str, left: Sequence[Floats], sd: float) -> float:
    """Share of the energy of residuals (n,) that functions of a covariate take."""
    B = np.concatenate([g.B[name][:, 0, :] for g in linear.model.groups]) / sd
    y = np.concatenate(list(left))
    c = np.linalg.lstsq(B, y, rcond=1e-9)[0]
    return float(np.clip(1.0 - np.sum((y - B @ c) ** 2) / max(float(np.sum(y**2)), 1e-300), 0.0, 1.0))


def _parameters(term: AxisCause, amount: Floats, half: Floats, spreads: Mapping[str, float]) -> dict[str, Estimate]:
    """Parameters that show as the effect's file has them; shapes that were fitted with the deviation of a fit around them."""
    out: dict[str, Estimate] = {}
    values = term.cause(amount.tolist()).values
    for p, a, h in zip(term.parameters, amount.tolist(), half.tolist(), strict=True):
        low, value, high = (p.value(each * p.scale) for each in (a - h, a, a + h))
        if p.name in values and h > 0.0:
            out[p.name] = Estimate.stated(value, low, high)
    if hasattr(term.module, "public"):
        ends = [term.cause(np.maximum(amount + sign * half, 0.0).tolist()).values for sign in (-1.0, 0.0, 1.0)]
        for name in term.module.public({p.name: p.nominal for p in term.module.FITTED}):
            if name not in term.shape:
                low, value, high = (each[name] for each in ends)
                out[name] = Estimate.stated(value, low, high)
    for name in [each for each in term.shape if each in values and each not in term.switches]:
        value = term.shape[name]
        if name in term.known:
            low, high = value - term.known[name], value + term.known[name]
        else:
            factor = float(np.exp(1.96 * float(np.hypot(spreads.get(name, 0.0), KNOWN))))
            low, high = (term.bounded(name, each) for each in (value / factor, value * factor))
        out[name] = Estimate.stated(value, low, high)
    return out


def _spreads_of_shapes(
    data: ChannelData, terms: Sequence[AxisCause], linear: LinearFit, amount: Sequence[Floats], sd: float
) -> dict[int, dict[str, float]]:
    """Standard deviations of logarithms of shapes by term; a length is not known better than the positions of rows."""
    members = linear.found.members
    names = scanned(terms, members)
    out: dict[int, dict[str, float]] = {}
    if names:
        _, spread = jointly(data, terms, members, amount, sd, settings=True)
        first = sum(len(amount[i]) for i in members)
        for (i, name), own in zip(names, spread[first:].tolist(), strict=False):
            length = any(p.name == name and p.unit in ("mm", "rad") for p in terms[i].module.PARAMETERS)
            apart = length * data.scatter / (lever_mm(data.hinge) * terms[i].shape[name])
            out.setdefault(i, {})[name] = float(np.hypot(own, apart))
    return out
