"""The parts of an arm's result: gap, causes with their sizes and chances, alternatives, places, what to measure next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from camcomp.diagnosis.arm.curves import curve_of
from camcomp.diagnosis.arm.dependence import Dependence
from camcomp.diagnosis.arm.discrepancy import regions, without_nuisance
from camcomp.diagnosis.arm.drivers import drivers
from camcomp.diagnosis.arm.fit import ArmFit
from camcomp.diagnosis.arm.forward_selection import LEAST_GAIN, Step, odds, rms
from camcomp.diagnosis.arm.gate import MINOR, Gate, standing_out, windows
from camcomp.diagnosis.arm.next_poses import POSES_SEED, proposed, unseen_share
from camcomp.diagnosis.arm.noise_floor import TipFloor
from camcomp.diagnosis.arm.poses import CURVE, ArmBench
from camcomp.diagnosis.arm.unseen import Court, Rival
from camcomp.diagnosis.result.types import (
    UNKNOWN,
    CurveCause,
    Driver,
    ErrorCurve,
    Estimate,
    FoundCause,
    GapSize,
    IntervalShare,
    MinorEffect,
    NamedCause,
    NextExperiment,
    PlaceShare,
    PosesToMeasure,
    UnknownCause,
    Where,
)
from camcomp.diagnosis.statistics.probability import EVEN, UNSURE, probability_of_chance, stated
from camcomp.ground.datatypes import Floats

FAINT = 0.01  # of the floor: what moves the tip less is not worth a line
LEAST_TARGET = 0.5  # probability above which an actuator is named
PLACES = 8  # parts of the workspace
REPEATS = 20  # poses to be visited again: a floor known to a sixth


@dataclass(frozen=True, eq=False)
class Told:
    """All that an answer is made of."""

    bench: ArmBench
    found: ArmFit
    gate: Gate
    floor: TipFloor | None
    sets: Sequence[Rival]
    verdict: Any
    judges: Court


def gap(gaps: Sequence[Floats], floor: TipFloor | None) -> GapSize:
    """Size of gaps (n, 3) mm."""
    size = 1e3 * np.linalg.norm(np.concatenate(list(gaps)), axis=1)
    return GapSize(
        rms_um=_round(np.sqrt(np.mean(size**2))),
        p95_um=_round(np.quantile(size, 0.95)),
        max_um=_round(size.max()),
        noise_floor_um=None if floor is None else _round(floor.um),
    )


# -- causes -----------------------------------------------------------------------------------------------------------


def causes(told: Told, gaps: Sequence[Floats]) -> tuple[tuple[FoundCause, ...], tuple[MinorEffect, ...]]:
    """Effects with the actuators that matter, the unknown one last, and those too small to be causes.

    Shares are of unseen poses and follow the order in which the groups were taken; those of few causes are of the squares of
    all poses. A set that has rivals is as probable as it is among them.
    """
    found = told.found
    before = found.taken.none
    whole = float(np.mean(before.squares))
    full = found.evidence.value(np.where(found.amount != 0.0, found.taken.widths, 0.0))
    weights = _weights(told)
    out: list[FoundCause] = []
    minor: list[MinorEffect] = []
    for step in found.taken.steps:
        share = float(np.mean(before.squares) - np.mean(step.squares)) / whole
        effect = found.effect(step.group)
        sure = min(odds(step.density - before.density), weights.get(step.group, 1.0))
        targets = list(dict.fromkeys(_targets(found, step.group)))
        own = [_target(found, step, target, full) for target in targets]
        energy = sum(e for e, _, _ in own)
        if found.few is not None:  # some act on one campaign only, and on no other that is withheld
            share = min(energy / sum(float((gap**2).sum()) for gap in gaps), 1.0)
        for (e, probability, parameters), target in zip(own, targets, strict=True):
            if found.few is not None:
                sure, probability = weights[step.group], found.few.places[effect, target]
                probability = min(probability, _beside_unknown(told, e))
            size = 1e3 * float(np.sqrt(e / sum(len(b.r) for b in found.evidence.blocks)))
            if found.few is not None and (told.floor is None or size < told.floor.um):
                # without a floor nothing says whether all is explained; what is below it others may be wrong by
                probability = min(probability, UNSURE)
            if told.floor is not None and size < MINOR * told.floor.um:
                if size >= FAINT * told.floor.um:
                    minor.append(MinorEffect(effect=effect, target=target, size_um=_round(size)))
            elif probability >= LEAST_TARGET:
                cause = FoundCause(
                    effect=effect,
                    target=target,
                    probability=stated(min(sure, probability)),
                    share=round(float(share * e / energy), 4),
                    parameters=parameters,
                )
                out.append(cause if effect != CURVE else _curve(told, cause))
        before = step
    order = [found.effect(s.group) for s in found.taken.steps]
    out.sort(key=lambda c: (-c.probability, order.index(c.effect), -c.share))
    if told.verdict == "unknown" or (told.verdict == "ambiguous" and not out):
        left = round(_size(found.rest) ** 2 / _size(gaps) ** 2, 4)
        chance = probability_of_chance(told.gate.chance) if told.verdict == "unknown" else EVEN
        out.append(UnknownCause(target=None, probability=stated(chance), share=left))
    return tuple(out), (*minor, *_slight(told))


def _beside_unknown(told: Told, energy: float) -> float:
    """Probability that a cause beside something unknown is no imitation of it. energy: of its squares over all poses, mm2.

    The best of all effects takes the larger part of most of what none of them is; a cause that takes less than what is
    left is none of that size, and one that takes more is as likely an imitation as not.
    """
    if told.gate.word != "above":
        return 1.0
    noise = 0.0 if told.floor is None else 3.0 * told.floor.sd**2
    left = max(float(np.mean((np.concatenate(told.found.rest) ** 2).sum(axis=1))) - noise, 0.0)
    own = energy / sum(len(r) for r in told.found.rest)
    return min(own / max(own + left, 1e-300), EVEN)


def _curve(told: Told, cause: FoundCause) -> CurveCause:
    """The cause with the curve of its joint."""
    found = curve_of(told.bench, told.found, str(cause.target))
    low, high = (max(found.amplitude + s * 1.96 * found.amplitude_sd, 0.0) for s in (-1.0, 1.0))
    size = Estimate(value=_digits(found.amplitude), ci95=(_digits(low), _digits(high)))
    out = CurveCause(
        effect=cause.effect,
        target=cause.target,
        probability=cause.probability,
        share=cause.share,
        parameters={"amplitude_rad": size},
        curve=ErrorCurve(
            angle_deg=tuple(found.angle),
            error_rad=tuple(_digits(e) for e in found.error),
            sd_rad=tuple(_digits(s) for s in found.sd),
            seen_deg=found.seen,
            seen_share=round(found.seen_share, 4),
        ),
    )
    lists = {key: value for key, value in found.values.items() if isinstance(value, list)}
    out._settings = {
        key: [each if isinstance(each, list) else float(f"{each:.4g}") for each in value]
        for key, value in lists.items()
    }
    return out


def _weights(told: Told) -> dict[str, float]:
    """Probability of every group among the sets that explain alike.

    Within one campaign density does not count: n sets of which k hold a group make (k + 1) / (n + 2), Laplace's rule.
    """
    sets = told.sets
    density = np.array([s.density for s in sets])
    p = np.exp(density - density.max())
    p = p / p.sum()
    out = {}
    for group in told.found.groups:
        holds = np.array([group in s.groups for s in sets])
        if not told.judges.whole:
            some = (int(holds.sum()) + 1) / (len(sets) + 2)
            out[group] = some if told.gate.word == "at" else min(some, EVEN)  # what is left may be all that it is
        else:
            out[group] = 1.0 if told.found.few is not None else float(p[holds].sum())
    return out


def _slight(told: Told) -> tuple[MinorEffect, ...]:
    """Groups that were not taken, are there by density, and move the tip by less than matters."""
    if told.floor is None:
        return ()
    taken = told.found.taken
    last = (taken.none, *taken.steps)[-1]
    out = []
    for step in taken.refused:
        size = 1e3 * float(np.sqrt(max(rms(last.squares) ** 2 - rms(step.squares) ** 2, 0.0)))
        if step.density > last.density + LEAST_GAIN and FAINT * told.floor.um < size < MINOR * told.floor.um:
            out.append(MinorEffect(effect=step.group, target=None, size_um=_round(size)))
    return tuple(out)


def alternatives(told: Told, named: Sequence[FoundCause]) -> tuple[tuple[NamedCause, ...], ...]:
    """Sets that the poses cannot tell apart, the one that was taken first.

    Where it has no rival among effects, the rival is that something unknown is there as well.
    """
    known = tuple(NamedCause(effect=c.effect, target=c.target) for c in named if not isinstance(c, UnknownCause))
    others = [_members(told.found, each) for each in told.sets[1:]] if known else []
    if not others:
        others = [(*known, NamedCause(effect=UNKNOWN, target=None))]
    return (known, *others)


def _members(found: ArmFit, rival: Rival) -> tuple[NamedCause, ...]:
    """Effects of a set at the targets that matter to it."""
    widths = np.array(rival.widths)
    full = found.evidence.value(widths)
    out = []
    for group in rival.groups:
        chances = {}
        for target in dict.fromkeys(found.columns[j].target for j in found.groups[group]):
            less = widths.copy()
            less[[j for j in found.groups[group] if found.columns[j].target == target]] = 0.0
            chances[target] = odds(full - found.evidence.value(less))
        some = [t for t, p in chances.items() if p >= LEAST_TARGET] or [max(chances, key=lambda t: chances[t])]
        out += [NamedCause(effect=found.effect(group), target=target) for target in some]
    return tuple(out)


def _targets(found: ArmFit, group: str) -> list[str | None]:
    return [found.columns[j].target for j in found.groups[group] if found.amount[j] != 0.0]


def _target(found: ArmFit, step: Step, target: str | None, full: float) -> tuple[float, float, dict[str, Estimate]]:
    """Energy, probability and parameters of a group at one target."""
    own = [j for j in found.groups[step.group] if found.columns[j].target == target and found.amount[j] != 0.0]
    widths = np.where(found.amount != 0.0, found.taken.widths, 0.0)
    widths[own] = 0.0
    energy = 0.0
    for b in found.evidence.blocks:
        energy += float((without_nuisance(b.X[:, :, own] @ found.amount[own], b.N) ** 2).sum())
    parameters = {}
    for j in own:
        p = found.columns[j].parameter
        spread = 1.96 * float(np.sqrt(found.covariance[j, j]))
        low, high = (_digits(p.value((found.amount[j] + s * spread) * p.scale)) for s in (-1.0, 1.0))
        value = p.value(found.amount[j] * p.scale)
        parameters[p.name] = Estimate(value=_digits(value), ci95=(low, high))
        for name, shape, first, last in found.columns[j].shape:
            parameters[name] = Estimate(value=_digits(shape), ci95=(_digits(first), _digits(last)))
    return energy, odds(full - found.evidence.value(widths)), parameters


# -- where ------------------------------------------------------------------------------------------------------------


def where(told: Told, gaps: Sequence[Floats]) -> Where:
    """Shares of axes and actuators; with an unknown, what it depends on, when and in which places it stands out."""
    found, bench = told.found, told.bench
    energy = (np.concatenate(list(gaps)) ** 2).sum(axis=0)
    actuators = dict.fromkeys(bench.actuators, 0.0)
    stages: dict[str, float] = {}
    for step in found.taken.steps:
        for target in dict.fromkeys(_targets(found, step.group)):
            size, _, _ = _target(found, step, target, 0.0)
            stage = found.columns[found.groups[step.group][0]].module.STAGE
            stages[stage] = stages.get(stage, 0.0) + size
            if target is not None:
                actuators[target] += size
    total = max(sum(actuators.values()), 1e-300)
    most: Any = max(stages, key=lambda s: stages[s]) if stages else "structure"
    whole = max(float(energy.sum()), 1e-300)
    unknown = told.verdict == "unknown"
    intervals = _intervals(told) if unknown else ()
    return Where(
        stage=most,
        axes={axis: round(float(e) / whole, 4) for axis, e in zip("xyz", energy, strict=True)},
        actuators={name: round(size / total, 4) for name, size in actuators.items()},
        drivers=_drivers(told, intervals) if unknown else (),
        intervals=intervals,
        places=_places(told) if unknown else (),
    )


def _drivers(told: Told, intervals: Sequence[IntervalShare]) -> tuple[Driver, ...]:
    """What the leftover depends on, the most first: the time of stretches in which it is larger, where nothing else shows."""
    found = drivers(told.bench, told.judges.poses, told.gate)
    if not found and intervals:
        found = [Dependence("time", sum(each.share for each in intervals), 0.0)]
    return tuple(Driver(covariate=d.covariate, share=round(d.share, 4)) for d in found[:6])


def _intervals(told: Told) -> tuple[IntervalShare, ...]:
    """Stretches of a run's time in which the leftover is larger than elsewhere."""
    whole = max(sum(float((r**2).sum()) for r in told.gate.left.rest), 1e-300)
    out = []
    for poses, rest in zip(told.judges.poses, told.gate.left.rest, strict=True):
        square = (rest**2).sum(axis=1)
        for run in dict.fromkeys(str(name) for name in poses.run):
            rows = np.flatnonzero(poses.run == run)
            own = windows(poses.time[rows])
            for i in standing_out(square[rows], own):
                time, energy = poses.time[rows][own[i]], float(square[rows][own[i]].sum())
                out.append(
                    IntervalShare(
                        run=run, t0_s=float(time.min()), t1_s=float(time.max()), share=round(energy / whole, 4)
                    )
                )
    return tuple(sorted(out, key=lambda each: -each.share))


def _places(told: Told) -> tuple[PlaceShare, ...]:
    """Parts of the workspace, boxes in the machine frame, in which the leftover is larger than elsewhere."""
    point = np.concatenate([told.bench.standing(p, ()).hung.point for p in told.judges.poses])
    square = np.concatenate([(r**2).sum(axis=1) for r in told.gate.left.rest])
    group = regions(point, PLACES)
    parts = [np.flatnonzero(group == g) for g in np.unique(group)]
    whole = max(float(square.sum()), 1e-300)
    out = []
    for i in standing_out(square, parts):
        own = parts[i]
        x, y, z = ((_round(a.min()), _round(a.max())) for a in point[own].T)
        size = 1e3 * float(np.sqrt(square[own].mean()))
        share = round(float(square[own].sum()) / whole, 4)
        out.append(PlaceShare(x_mm=x, y_mm=y, z_mm=z, share=share, rms_um=_round(size)))
    return tuple(sorted(out, key=lambda each: -each.share))


# -- what to measure next -----------------------------------------------------------------------------------------------


def next_experiment(told: Told) -> NextExperiment | None:
    """Poses that tell most, as a campaign of their own; repeats where there is no floor."""
    if told.verdict in ("none", "identified"):
        return None
    if told.floor is None and told.judges.whole:
        return _again(told)
    found = told.found
    noise = told.floor.sd if told.floor else max(found.discrepancy.noise, 1e-6)
    q, place, gain = proposed(told.bench, found, noise)
    if not len(q):
        return None if told.judges.whole or not found.taken.steps else _second_campaign(told, q, place)
    if not told.judges.whole:
        return _second_campaign(told, q, place)
    new = 100.0 * unseen_share(told.bench, found, q)
    effects = [*dict.fromkeys(found.effect(s.group) for s in found.taken.steps), UNKNOWN]
    action = f"measure {len(q)} more poses with a clamping of their own"
    if new:
        action += f", {new:.0f} % of them with a joint at angles that no pose had"
    return NextExperiment(
        action=f"{action}; try them slowly first: collisions are not checked",
        separates=tuple(effects),
        gain=round(gain, 4),
        outcomes=(
            (
                "If the causes found leave no more on these poses than on the others, they hold there as well and their "
                "intervals become narrower."
            ),
            (
                "If they leave more, and the curves of the joints explain it once these poses are fitted, it was the angles "
                "that nobody had seen."
            ),
            "If they leave as much after that, what is unknown does not go by the angle of one joint.",
        ),
        poses=_listed(told, q, place),
    )


def _second_campaign(told: Told, q: Floats, place: Floats) -> NextExperiment:
    """Other postures, where there is one campaign only: within it, effects stand in for each other."""
    effects = list(dict.fromkeys(told.found.effect(g) for s in told.sets for g in s.groups))
    sets = ["; ".join(s.groups) for s in told.sets]
    return NextExperiment(
        action="measure a second campaign in other postures, with a clamping of its own",
        separates=tuple(effects),
        gain=round(float(np.log2(len(told.sets) + 1)), 4),
        outcomes=(
            *(f"If {one} alone foretell the new poses, they are the cause." for one in sets[:2]),
            "If no set foretells them, something unknown is at work.",
        ),
        poses=_listed(told, q, place) if len(q) else None,
    )


def _again(told: Told) -> NextExperiment:
    """Repeats: every other quantile of the poses there are, in an order that does not stay in one place."""
    effects = [*dict.fromkeys(told.found.effect(s.group) for s in told.found.taken.steps), UNKNOWN]
    campaign = told.bench.campaigns[0]
    some = np.unique(np.linspace(0, len(campaign.q) - 1, REPEATS).astype(int))
    some = some[np.random.default_rng(POSES_SEED).permutation(len(some))]
    again = campaign.take(some)
    return NextExperiment(
        action=f"visit {REPEATS} of the poses once more, other poses in between, so that the floor is known",
        separates=tuple(effects),
        gain=1.0,
        outcomes=(
            "If visits of one pose differ by as much as the causes leave, nothing is left to explain.",
            "If they differ by less, something unknown is at work.",
        ),
        poses=_listed(told, again.q, told.bench.standing(again, ()).hung.point),
    )


def _listed(told: Told, q: Floats, place: Floats) -> PosesToMeasure:
    return PosesToMeasure(
        joints=told.bench.actuators,
        positions=tuple(tuple(round(float(v), 6) for v in row) for row in q),
        platform_mm=tuple((_round(x), _round(y), _round(z)) for x, y, z in place),
    )


def _size(parts: Sequence[Floats]) -> float:
    every = np.concatenate(list(parts))
    return float(np.sqrt(np.mean((every**2).sum(axis=1))))


def _round(value: float) -> float:
    return round(float(value), 3)


def _digits(value: float) -> float:
    return float(f"{value:.6g}")
