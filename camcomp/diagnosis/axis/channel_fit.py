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

from camcomp.diagnosis.axis.channel_data import ACCELERATION, BEYOND, ChannelData
from camcomp.diagnosis.axis.effect_columns import AxisCause
from camcomp.diagnosis.axis.findings import lever_mm
from camcomp.diagnosis.axis.gate import KNOWN, LOCAL
from camcomp.diagnosis.axis.linear_sets import (
    CAUSES,
    PASSES,
    LinearChannel,
    LinearFit,
    jointly,
    refined_shapes,
    scanned,
    settled,
)
from camcomp.diagnosis.axis.noise_floor import noise_after_fit
from camcomp.diagnosis.model.calibration import calibration_of
from camcomp.diagnosis.model.discrepancy import gains_of_covariates, prior_of_covariate, share_of_covariate
from camcomp.diagnosis.model.evidence import Background
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
        values = [fit.settled(sd).found.log_evidence for fit in (free, minor)]
        if minor.excess <= data.floor**2 or values[0] + prior_of_covariate(free.model) < values[1]:
            free, large = minor, {kind: own for kind, own in _large(minor).items() if kind != ACCELERATION}
    return replace(_answer(free), unmodelled=large)


def _large(fit: LinearFit) -> dict[str, tuple[float, float]]:
    """Kinds of healthy sizes that are more than minor: share of the channel's energy, and log odds that they are."""
    data = fit.data
    out: dict[str, tuple[float, float]] = {}
    sizes = fit.residuals()[2]
    whole = float(np.mean(np.concatenate([data.values[k] for k in data.train]) ** 2))
    for kind in (each for each in BEYOND if each in sizes):
        square = float(np.mean(np.concatenate([data.healthy[k][kind] @ sizes[kind] for k in data.train]) ** 2))
        if square > data.minor_size(kind) ** 2:
            minor = replace(fit, data=replace(data, minor=data.minor | {kind}))
            values = [each.settled(fit.sd).found.log_evidence for each in (fit, minor)]
            gain = values[0] - values[1] + prior_of_covariate(fit.model)
            out |= {kind: (min(square / whole, 1.0), gain)} if gain > 0.0 else {}
    return out


def _most_probable(data: ChannelData, terms: Sequence[AxisCause]) -> LinearFit:
    """The most probable set of causes, with shapes and healthy sizes where it stands."""
    at = [np.zeros(len(t.parameters)) for t in terms]
    for again in range(PASSES + 1):
        here = LinearChannel.at(data, terms, at).with_misfit()
        fit = here.explained(here.noise)
        same = all(np.allclose(a, b, rtol=1e-3, atol=1e-6) for a, b in zip(at, fit.amounts, strict=True))
        late = data.clock > 0.0 and again == 0  # rows may be late without any cause, too
        if again == PASSES or (not late and (same or not fit.members)):
            break
        left, _, sizes = fit.residuals()
        data = fit.data.refined(left, sizes)
        terms, at = refined_shapes(data, terms, fit.members, fit.amounts, fit.sd)
    if data.channel == "following" and fit.excess > LOCAL * data.floor**2:
        fit = _among_every_set(fit)
    return _without_needless(_without_needless_parameters(fit))


def _among_every_set(fit: LinearFit) -> LinearFit:
    """The most probable of all sets of causes of a loop, each with its own shapes and made linear where it stands.

    Loops of one axis are much alike as long as they are linear, so that steps from one set do not lead to every other. The
    deviation of a row is that which the best of them leaves.
    """
    data, terms, every = fit.data, fit.terms, {}
    for on in sets_of_places([t.place for t in terms], CAUSES):
        at = [np.zeros(len(t.parameters)) for t in terms]
        amount, by = settled(data, terms, at, on=on, sd=data.floor, passes=1).amounts, [*terms]
        at = [_begun(terms[i], amount[i]) if i in on else each for i, each in enumerate(at)]
        for _ in range(ROUNDS):
            by, at = refined_shapes(data.where(by, at), by, on, at, data.floor)
        every[on] = LinearChannel.at(data, by, at)
    sd = min(each.noise for each in every.values())
    return max((each.explained(sd, on) for on, each in every.items()), key=lambda found: found.value)


def _begun(term: AxisCause, amount: Floats) -> Floats:
    """Amplitudes (d,) of a cause from which it is fitted: those of its guess where a tangent has the wrong sign."""
    wrong = any(p.sign * a < 0.0 for p, a in zip(term.parameters, amount, strict=True))
    return np.array(term.steps) if wrong and term.steps else amount


def _without_needless(fit: LinearFit) -> LinearFit:
    """The fit without causes that the others, or a function of one covariate, explain as well.

    Sets are made linear where they stand. A cause goes, too, where it is as large as on every healthy machine.
    """
    while fit.members:
        terms, at = fit.acting
        every = tuple(range(len(terms)))
        sets = [every, *(tuple(i for i in every if i != out) for out in every)]
        whole, *less = (settled(fit.data, terms, at, on=on, sd=fit.sd) for on in sets)
        best = max(less, key=lambda found: found.value)
        if best.value < whole.value and best.excess - whole.excess > (MINOR * fit.data.floor) ** 2:
            break
        fit = best
    return fit


def _without_needless_parameters(fit: LinearFit) -> LinearFit:
    """The fit with the causes of fewer parameters that are more probable where they stand, as the linear ones did not show."""
    every, candidates = tuple(range(len(fit.members))), fit.terms
    while options := _with_fewer_parameters(*fit.acting, candidates):
        shaped = [refined_shapes(fit.data, terms, every, at, fit.sd) for terms, at in options]
        fits = [settled(fit.data, *each, on=every, sd=fit.sd) for each in (fit.acting, *shaped)]
        best = max(fits, key=lambda found: found.found.log_evidence)
        if best is fits[0]:
            break
        fit = best
    return fit


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


def _answer(fit: LinearFit) -> ChannelFit:
    data, found, model = fit.data, fit.found, fit.model
    deviation = fit.by_term(np.sqrt(np.diag(found.amplitudes()[1])))
    at = model.posterior(found.background, found.data.slab(found.members))
    every, units = np.concatenate([fit.slots(kind) for kind in fit.unit]), np.concatenate([*fit.unit.values()])
    among = at.covariance(every.tolist()) * np.outer(units, units)
    left, amount, sizes = fit.residuals()
    spreads = _spreads_of_shapes(fit)
    scale = calibration_of("axes")
    causes, acting, imitated, train = [], [], [], [left[k] for k in data.train]
    excess = float(np.sqrt(max(float(np.mean(np.concatenate(train) ** 2)) - data.floor**2, 0.0)))
    gains = _drivers(fit, left)
    whole = sum(float(np.sum((data.values[k] - data.level) ** 2)) for k in data.train)
    for i in found.members:
        term = fit.terms[i]
        own = [data.response(k, [(term, amount[i])]) for k in data.train]
        if float(np.mean(np.concatenate(own) ** 2)) < (MINOR * data.floor) ** 2:
            continue  # as large as on every healthy machine
        less = sum(float(np.sum((left[k] + each) ** 2)) for k, each in zip(data.train, own, strict=True))
        rest = sum(float(np.sum(left[k] ** 2)) for k in data.train)
        half = 1.96 * scale.interval * deviation[i] + KNOWN * np.abs(amount[i])
        acting.append((term, amount[i]))
        imitated.append(_no_imitation(fit, i, effect=np.concatenate(own), excess=excess, gains=gains[1]))
        causes.append(
            FoundCause(
                effect=term.effect, target=term.target,
                probability=scale.calibrate(found.places[term.place]),
                share=round(min(max((less - rest) / max(whole, 1e-300), 0.0), 1.0), 4),
                parameters=_parameters(term, amount[i], half, spreads.get(i, {})),
            )
        )  # fmt: skip
    drivers, hints = (
        {
            n: share_of_covariate(model, found.background, b, found.members)
            for n, (gain, b) in each.items()
            if gain > 0.0
        }
        for each in gains
    )
    return ChannelFit(
        causes=tuple(causes), acting=tuple(acting), sizes=sizes, covariance=among, left=left, drivers=drivers,
        hints=hints, columns=_design(fit), imitated=tuple(imitated),
    )  # fmt: skip


def _no_imitation(
    fit: LinearFit, i: int, *, effect: Floats, excess: float, gains: Mapping[str, tuple[float, Background]]
) -> float:
    """Probability of a member with an effect (n,), where an excess residual (rms) over the floor is unmodelled for certain."""
    found, term = fit.found, fit.terms[i]
    others = tuple(j for j in found.members if j != i)
    alike = 1.0 if term.run else term.ways  # shapes of one cause, but windows, are imitated together
    design = _design(fit, i)
    functions = {
        name: (gains[name][0], products_across(effect, design, fit.columns(on), fit.sd))
        for name, on in fit.functions.items()
    }
    return probability_with_unmodelled(
        float(np.sqrt(np.mean(effect**2))), functions, rows=len(effect), excess=excess, floor=fit.data.floor,
        odds=found.data.prior(found.members) - found.data.prior(others) + float(np.log(alike)),
    )  # fmt: skip


def _design(fit: LinearFit, without: int | None = None) -> Floats:
    """Columns (n, k) of the causes that act, but for one, and of healthy sizes, per standard deviation of their amplitudes before
    the data.
    """
    slab = fit.found.data.slab(fit.members)
    on = [j for i in fit.members if i != without for j in fit.model.candidates[i].columns]
    on += [j for kind in fit.unit for j in fit.slots(kind).tolist()]
    return np.asarray(fit.columns(on) * np.array([slab.get(j, 1.0) for j in on]), float)


def _drivers(fit: LinearFit, left: Sequence[Floats]) -> list[dict[str, tuple[float, Background]]]:
    """Covariates by which residuals (n,) go: log Bayes factors, priors included, and backgrounds; and the same where the noise is
    what functions of all covariates leave.
    """
    every = np.concatenate([np.zeros(0, int), *fit.functions.values()])
    B, y = (
        fit.columns(every) / np.concatenate([g.sd for g in fit.model.groups]),
        fit.data.in_floors(dict(enumerate(left))),
    )
    rest = noise_after_fit(B, y, fit.data.floor)
    backgrounds = (replace(fit.found.background, noise=factor) for factor in (1.0, min(rest / fit.sd, 1.0)))
    return [gains_of_covariates(fit.model, each, fit.members) for each in backgrounds]


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


def _spreads_of_shapes(fit: LinearFit) -> dict[int, dict[str, float]]:
    """Standard deviations of logarithms of shapes by term; a length is not known better than the positions of rows."""
    data, members, out = fit.data, fit.members, dict[int, dict[str, float]]()
    names = scanned(fit.terms, members)
    if names:
        _, spread = jointly(data, fit.terms, members, fit.amounts, fit.sd, settings=True)
        first = sum(len(fit.amounts[i]) for i in members)
        for (i, name), own in zip(names, spread[first:].tolist(), strict=False):
            length = any(p.name == name and p.unit in ("mm", "rad") for p in fit.terms[i].module.PARAMETERS)
            apart = length * data.scatter / (lever_mm(data.hinge) * fit.terms[i].shape[name])
            out.setdefault(i, {})[name] = float(np.hypot(own, apart))
    return out
