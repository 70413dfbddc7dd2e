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

from camcomp.diagnosis.axis.channel_data import ACCELERATION, BEYOND, MASSES, ChannelData
from camcomp.diagnosis.axis.effect_columns import AxisCause
from camcomp.diagnosis.axis.findings import lever_mm
from camcomp.diagnosis.axis.gate import KNOWN
from camcomp.diagnosis.axis.linear_sets import LinearFit, by_cause, by_term, jointly, most_probable
from camcomp.diagnosis.axis.noise_floor import noise_after_fit
from camcomp.diagnosis.model.calibration import calibration_of
from camcomp.diagnosis.model.discrepancy import gains_of_covariates, prior_of_covariate, share_of_covariate
from camcomp.diagnosis.model.evidence import Background
from camcomp.diagnosis.model.imitation import probability_with_unmodelled, products_across
from camcomp.diagnosis.model.noise import MINOR
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
    That of the acceleration is weighed against causes beside which it is not; what is left below the floor is none. The load of
    stated masses is as likely as a covariate before the rows are seen.
    """
    free = most_probable(data, terms)
    if MASSES in data.healthy[0]:
        bare = most_probable(data.without(MASSES), terms)
        values = [fit.again(min(free.sd, bare.sd)).found.log_evidence for fit in (free, bare)]
        if values[0] + prior_of_covariate(free.model) < values[1]:
            data, free = data.without(MASSES), bare
    large = _large(free) if data.channel == "following" else {}
    if ACCELERATION in large:
        minor = most_probable(replace(data, minor=frozenset({ACCELERATION})), terms)
        sd = min(free.sd, minor.sd)
        values = [fit.again(sd).found.log_evidence for fit in (free, minor)]
        if minor.excess <= data.floor**2 or values[0] + prior_of_covariate(free.model) < values[1]:
            free, large = minor, {kind: own for kind, own in _large(minor).items() if kind != ACCELERATION}
    return replace(_answer(free), unmodelled=large)


def _large(fit: LinearFit) -> dict[str, tuple[float, float]]:
    """Kinds of healthy sizes that are more than minor: share of the channel's energy, and log odds that they are."""
    data = fit.data
    out: dict[str, tuple[float, float]] = {}
    sizes = fit.residuals[1]
    whole = float(np.mean(np.concatenate([data.values[k] for k in data.train]) ** 2))
    for kind in (each for each in BEYOND if each in sizes):
        square = float(np.mean(np.concatenate([data.healthy[k][kind] @ sizes[kind] for k in data.train]) ** 2))
        if square > data.minor_size(kind) ** 2:
            minor = fit.again(fit.sd, data.minor | {kind})
            gain = fit.found.log_evidence - minor.found.log_evidence + prior_of_covariate(fit.model)
            out |= {kind: (min(square / whole, 1.0), gain)} if gain > 0.0 else {}
    return out


def _answer(fit: LinearFit) -> ChannelFit:
    data, found, model = fit.data, fit.found, fit.model
    deviation = by_term(fit.acting, np.sqrt(np.diag(found.amplitudes()[1])))
    at = model.posterior(found.background, found.data.slab(found.members))
    every, units = np.concatenate([fit.slots(kind) for kind in fit.unit]), np.concatenate([*fit.unit.values()])
    among = at.covariance(every.tolist()) * np.outer(units, units)
    (left, sizes), amount = fit.residuals, fit.amounts
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
                probability=scale.calibrate(fit.probability[term.place]),
                share=round(min(max((less - rest) / max(whole, 1e-300), 0.0), 1.0), 4),
                parameters=_parameters(term, amount[i], half, spreads[i]),
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
    slab = fit.found.data.slab(fit.found.members)
    on = [j for i in fit.found.members if i != without for j in fit.model.candidates[i].columns]
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
    return [gains_of_covariates(fit.model, each, fit.found.members) for each in backgrounds]


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
    for name, around in term.known.items():
        out[name] = Estimate.stated(term.shape[name], term.shape[name] - around, term.shape[name] + around)
    for name in [each for each in term.free if each in values]:
        value, factor = term.shape[name], float(np.exp(1.96 * float(np.hypot(spreads[name], KNOWN))))
        out[name] = Estimate.stated(value, term.bounded(name, value / factor), term.bounded(name, value * factor))
    return out


def _spreads_of_shapes(fit: LinearFit) -> list[dict[str, float]]:
    """Standard deviations of logarithms of free shapes by term; a length is not known better than the positions of rows."""
    data, out = fit.data, []
    parts = by_cause(fit.acting, jointly(data, fit.acting, fit.sd)[1])
    for term, own, spread in zip(fit.terms, fit.amounts, parts, strict=True):
        lengths = {p.name for p in term.module.PARAMETERS if p.unit in ("mm", "rad")}
        apart = {
            name: data.scatter / (lever_mm(data.hinge) * term.shape[name]) for name in lengths.intersection(term.free)
        }
        each = dict(zip(term.free, spread[len(own) :].tolist(), strict=True))
        out.append({name: float(np.hypot(value, apart.get(name, 0.0))) for name, value in each.items()})
    return out
