"""The parts of an arm's result: gap, causes with their sizes and chances, alternatives, places, what to measure next."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.stats import ranksums as rank_sums

from camcomp.diagnosis.arm.case import PoseCase
from camcomp.diagnosis.arm.curves import curve_cause
from camcomp.diagnosis.arm.linear import BY
from camcomp.diagnosis.arm.poses import CURVE
from camcomp.diagnosis.model.calibration import calibration_of
from camcomp.diagnosis.model.discrepancy import gains_of_covariates, share_of_covariate
from camcomp.diagnosis.model.evidence import Background
from camcomp.diagnosis.model.folds import REGIONS, without_nuisances
from camcomp.diagnosis.model.noise import HEALTHY, LEAST_VALUES, MINOR
from camcomp.diagnosis.model.verdict import decide
from camcomp.diagnosis.result.types import (
    MOST_LISTED,
    Driver,
    Estimate,
    FoundCause,
    IntervalShare,
    MinorEffect,
    NamedCause,
    UnknownCause,
    Where,
    alternatives_of,
)
from camcomp.diagnosis.statistics.places import FALSE, shares
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS, EVEN
from camcomp.ground.datatypes import Floats

# -- causes -----------------------------------------------------------------------------------------------------------


def causes(case: PoseCase) -> tuple[tuple[FoundCause, ...], tuple[MinorEffect, ...]]:
    """Causes of the most probable set in falling probability, and those too small to be causes."""
    whole, rows = _energy(case.gaps), sum(map(len, case.gaps))
    out: list[FoundCause] = []
    minor: list[MinorEffect] = []
    for part in case.parts:
        energy = energy_of(case, part.columns)
        size = 1e3 * float(np.sqrt(energy / rows))
        if case.floor is not None and size < MINOR * case.floor.um:
            if size >= HEALTHY * case.floor.um:
                minor.append(MinorEffect(effect=part.effect, target=part.target, size_um=round(size, 3)))
            continue
        cause = FoundCause(
            effect=part.effect,
            target=part.target,
            probability=calibration_of(case.kind).calibrate(part.probability),
            share=round(min(energy / whole, 1.0), 4),
            parameters=parameters_of(case, part.columns),
        )
        if part.effect == CURVE:
            on = part.columns
            columns, covariance = [case.shelf.columns[j] for j in on], case.covariance[np.ix_(on, on)]
            cause = curve_cause(
                case.bench, cause, columns, amount=case.amount[on], covariance=covariance, wide=case.wide
            )
        out.append(cause)
    out.sort(key=lambda c: (-c.probability, -c.share))
    return tuple(out), tuple(minor)


def energy_of(case: PoseCase, on: Sequence[int]) -> float:
    """Sum of squares, mm2, of what columns move the tips by, frames fitted."""
    groups = [case.model.groups[k] for k in case.bench.own]
    return sum(float((without_nuisances(g.A[:, :, on] @ case.amount[on], g.N) ** 2).sum()) for g in groups)


def parameters_of(case: PoseCase, on: Sequence[int]) -> dict[str, Estimate]:
    """Parameters of columns with their intervals."""
    out = {}
    for j in on:
        column = case.shelf.columns[j]
        p, spread = column.parameter, case.wide * float(np.sqrt(case.covariance[j, j]))
        low, value, high = (p.value((case.amount[j] + s * spread) * p.scale) for s in (-1.0, 0.0, 1.0))
        out[p.name] = Estimate.stated(value, low, high)
        for name, shape, first, last in column.shape:
            out[name] = Estimate.stated(shape, first, last)
    return out


def verdict(case: PoseCase, named: Sequence[FoundCause]) -> Any:
    """The word of the result."""
    calibrate = calibration_of(case.kind).calibrate
    return decide(
        unknown=case.unmodelled,
        best=min([_best(case, calibrate), *(c.probability for c in named)]),
        alternatives=len(case.alternatives()) - 1,
        causes=len(named),
        known_noise=case.floor is not None,
        confirmed=None if case.check is None else case.check.at_floor,
    )


def _best(case: PoseCase, calibrate: Callable[[float], float]) -> float:
    """Probability that all causes of the best set act; of the empty set, that the most probable cause does not."""
    found = case.explanation
    if not found.members:
        return 1.0 - calibrate(max(found.places.values(), default=0.0))
    own = set(case.places(found.members))
    return calibrate(sum(p for _, places, p in found.sets if own <= places))


def with_unknown(case: PoseCase, named: tuple[FoundCause, ...], word: str) -> tuple[FoundCause, ...]:
    """The causes of a verdict: none for `none`; with the unknown cause where something unmodelled is, or nothing is named."""
    if word == "none":
        return ()
    if word == "unknown" or (word == "ambiguous" and not named):
        share = round(min(_energy(case.rest) / _energy(case.gaps), 1.0), 4)
        probability = case.unmodelled if word == "unknown" else EVEN
        return (*named, UnknownCause(target=None, probability=probability, share=share))
    return named


def alternatives(case: PoseCase, named: Sequence[FoundCause]) -> tuple[tuple[NamedCause, ...], ...]:
    """Sets that are indistinguishable by the poses, the best first."""
    known = [c.named for c in named if not isinstance(c, UnknownCause)]
    others = [tuple(NamedCause(effect=e, target=t) for e, t in case.places(m)) for m in case.alternatives()[1:]]
    return alternatives_of(known, [each for each in others if each and known])


# -- where ------------------------------------------------------------------------------------------------------------


def where(case: PoseCase, word: str) -> Where:
    """Shares of axes and actuators; for an unknown cause its covariates, and the intervals above the noise."""
    energy = (np.concatenate(list(case.gaps)) ** 2).sum(axis=0)
    actuators = dict.fromkeys(case.bench.actuators, 0.0)
    stages: dict[str, float] = {}
    for part in case.parts:
        size, stage = energy_of(case, part.columns), case.shelf.columns[part.columns[0]].module.STAGE
        stages[stage] = stages.get(stage, 0.0) + size
        if part.target in actuators:
            actuators[part.target] += size
    most: Any = max(stages, key=lambda s: stages[s]) if stages else "structure"
    intervals = _intervals(case) if word == "unknown" else ()
    return Where(
        stage=most,
        axes=shares(dict(zip("xyz", energy.tolist(), strict=True))),
        actuators=shares(actuators),
        drivers=drivers(case, intervals) if word == "unknown" else (),
        intervals=intervals,
    )


def drivers(case: PoseCase, intervals: Sequence[IntervalShare]) -> tuple[Driver, ...]:
    """Covariates of the residual with the share of its energy that each explains alone, the most first.

    Where none is clear: time where stretches of it stand out, else the covariate that explains most.
    """
    found = case.explanation
    plain = Background(found.background.noise, families=found.background.families)
    gains = gains_of_covariates(case.model, plain, found.members)
    if not gains:
        return ()
    clear = {name for name, (gain, _) in gains.items() if gain > EQUAL_LOG_ODDS}
    clear |= {name for name, _ in found.background.scales}
    if not clear and intervals:
        return (Driver(covariate="time", share=round(min(sum(i.share for i in intervals), 1.0), 4)),)
    clear = clear or {max(gains, key=lambda name: gains[name][0])}
    shares: dict[str, float] = {}
    for name in clear & set(gains):
        key = name.split(BY)[0]
        share = share_of_covariate(case.model, plain, gains[name][1], found.members)
        shares[key] = max(shares.get(key, 0.0), share)
    if found.background.process is not None and found.background.process.over == "time":
        shares.setdefault("time", max(shares.values(), default=0.0))
    order = sorted(shares, key=lambda name: -shares[name])
    return tuple(Driver(covariate=name, share=round(shares[name], 4)) for name in order[:MOST_LISTED])


def _energy(parts: Sequence[Floats]) -> float:
    return sum(float((r**2).sum()) for r in parts)


def _intervals(case: PoseCase) -> tuple[IntervalShare, ...]:
    """Stretches of a run's time in which the residual is larger than elsewhere: rank sums, 1 % over all of a run.

    A run has at most REGIONS stretches of LEAST_VALUES poses or more. Source: Mann, Whitney, Ann. Math. Stat. 18 (1947) 50.
    """
    whole = max(_energy(case.rest), 1e-300)
    out = []
    for k, rest in zip(case.bench.own, case.rest, strict=True):
        poses, square = case.bench.campaigns[k], (rest**2).sum(axis=1)
        for run in dict.fromkeys(str(name) for name in poses.run) if poses.has_clock else ():
            rows = np.flatnonzero(poses.run == run)
            rows = rows[np.argsort(poses.time[rows], kind="stable")]
            count = min(REGIONS, len(rows) // LEAST_VALUES)
            for own in np.array_split(rows, count) if count > 1 else ():
                chance = rank_sums(square[own], square[np.setdiff1d(rows, own)], alternative="greater").pvalue
                if chance >= FALSE / count:
                    continue
                time, energy = poses.time[own], float(square[own].sum())
                out.append(
                    IntervalShare(
                        run=run, t0_s=float(time.min()), t1_s=float(time.max()), share=round(energy / whole, 4)
                    )
                )
    return tuple(sorted(out, key=lambda each: -each.share))
