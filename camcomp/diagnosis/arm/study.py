"""Why an arm's measured poses differ from its model: causes that hold for campaigns they were not fitted on.

Inside one campaign many effects explain the same poses; with other poses most of them make it worse. So groups of
effects are judged by campaigns that are withheld, or by regions of postures where there is only one campaign, and
what no group predicts is stated as unknown, with what it depends on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from camcomp.diagnosis.arm.dependence import shares, turns
from camcomp.diagnosis.arm.discrepancy import (
    Discrepancy,
    Evidence,
    ResidualBlock,
    fit_discrepancy,
    regions,
    without_nuisance,
)
from camcomp.diagnosis.arm.forward_selection import LEAST_SHARE, Step, Taken, odds, rms, take
from camcomp.diagnosis.arm.poses import ArmBench, Column, Poses, combined, visible
from camcomp.diagnosis.result.types import (
    DiagnosisResult,
    Driver,
    Estimate,
    Floor,
    FoundCause,
    GapSize,
    ShrinkageStep,
    UnknownCause,
    UnseenShrinkage,
    Where,
)
from camcomp.diagnosis.statistics.probability import stated
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause
from camcomp.model.statics.arm import jacobian
from camcomp.model.statics.description import Robot

MOST_POSES = 1200  # of a campaign; more are drawn from
REGIONS = 8  # of postures, where there is one campaign only
HYPER_POSES = 400  # rows of a region on which the discrepancy is fitted
DRAWS = 2000
CAMPAIGN_SEED = 20200714  # drawing has to give the same answer twice
UNKNOWN_FACTOR = 1.5  # leftover over noise floor
LEAST_TARGET = 0.5  # probability above which an actuator is named


@dataclass(frozen=True, eq=False)
class ArmFit:
    """The fit behind a result: columns, which were taken with their amplitudes and covariance, and the leftovers."""

    columns: tuple[Column, ...]
    groups: dict[str, list[int]]
    taken: Taken
    amount: Floats  # (k,) in units of scales
    covariance: Floats  # (k, k)
    discrepancy: Discrepancy
    evidence: Evidence
    linear: tuple[ResidualBlock, ...]
    rest: tuple[Floats, ...]  # (n, 3) mm per campaign, machine frame

    def causes(self, groups: Sequence[str] | None = None) -> list[Cause]:
        """Causes of the groups taken, or of some of them."""
        names = [s.group for s in self.taken.steps] if groups is None else groups
        on = {j: float(self.amount[j]) for name in names for j in self.groups[name] if self.amount[j] != 0.0}
        return combined(self.columns, on)


def study(
    robot: Robot,
    causes: Sequence[Cause],
    runs: Sequence[Poses],
    *,
    holdout: Sequence[str] = (),
    without: Sequence[str] = (),
) -> DiagnosisResult:
    """Result for static poses of an arm. runs: one entry per run, whose label is its campaign (clamping).

    holdout: names of runs (`Poses.run`) that are judged and never fitted; only their frames are. Raises ValueError when
    a campaign has too few poses for its frames.
    """
    names = [str(each.run[0]) for each in runs]
    campaigns = merged([r for r, name in zip(runs, names, strict=True) if name not in holdout])
    if not campaigns:
        raise ValueError("every run is held out")
    bench = ArmBench(robot, tuple(causes), campaigns)
    found = investigate(bench, without)
    held = merged([r for r, name in zip(runs, names, strict=True) if name in holdout])
    judge = ArmBench(robot, tuple(causes), held) if held else None
    if judge is not None and (kept := holding(found, judge)) < len(found.taken.steps):
        found = fitted(bench, found.columns, found.groups, found.linear, found.discrepancy, shortened(found, kept))
    gaps = [bench.gap(k, ()) for k in range(len(campaigns))]
    floor = 1e3 * np.sqrt(3.0) * found.discrepancy.noise
    left = 1e3 * _size(found.rest)
    unknown = left > UNKNOWN_FACTOR * floor
    unseen = judge is not None or len(campaigns) > 1
    return DiagnosisResult(
        verdict="unknown" if unknown else "identified" if found.taken.steps else "none",
        gap=_gap(gaps, floor),
        where=_where(bench, gaps, found, unknown),
        causes=_causes(bench, found, gaps, UNKNOWN_FACTOR * floor if unknown else None),
        shrinkage=_shrinkage(judge, found, [n for n in names if not holdout or n in holdout]) if unseen else None,
        floor=Floor(um=None, source="not identifiable"),
    )


def merged(runs: Sequence[Poses]) -> list[Poses]:
    """One entry per campaign, with at most MOST_POSES poses, drawn evenly."""
    out = []
    for label in dict.fromkeys(r.label for r in runs):
        own = [r for r in runs if r.label == label]
        heats = [r.temperature for r in own]
        heat = None if any(h is None for h in heats) else np.concatenate([h for h in heats if h is not None])
        q, tip, time, run = (np.concatenate([getattr(r, f) for r in own]) for f in ("q", "tip", "time", "run"))
        every = Poses(label, q, tip, time, heat, run)
        n = len(every.q)
        if n < 12:
            raise ValueError(f"campaign '{label}' has {n} poses; its frames alone need more")
        if n > MOST_POSES:
            every = every.take(np.sort(np.random.default_rng(CAMPAIGN_SEED).choice(n, MOST_POSES, replace=False)))
        out.append(every)
    return out


def investigate(bench: ArmBench, without: Sequence[str] = ()) -> ArmFit:
    """Groups that predict withheld blocks, fitted through the model itself."""
    columns = bench.columns(without)
    linear = bench.blocks(columns)
    seen = visible(linear, columns)
    columns = [columns[j] for j in seen]
    linear = [replace(b, X=b.X[:, :, seen]) for b in linear]
    groups: dict[str, list[int]] = {}
    for j, column in enumerate(columns):
        groups.setdefault(column.effect, []).append(j)
    discrepancy = _discrepancy(linear)
    taken = take(Evidence.of(_parts(linear), discrepancy), groups)
    return fitted(bench, columns, groups, linear, discrepancy, taken)


def fitted(
    bench: ArmBench, columns: Sequence[Column], groups: dict[str, list[int]], linear: Sequence[ResidualBlock],
    discrepancy: Discrepancy, taken: Taken,
) -> ArmFit:  # fmt: skip
    """Amplitudes of the groups taken, by the model itself instead of its derivative at nominal."""
    amount = np.zeros(len(columns))
    covariance = np.zeros((len(columns), len(columns)))
    widths = taken.widths.copy()
    evidence = Evidence.of(linear, discrepancy)
    for _ in range(2 if taken.steps else 0):
        amount, covariance = evidence.fit(widths)
        wrong = [j for j, c in enumerate(columns) if c.parameter.sign > 0 and amount[j] < 0.0]
        widths[wrong] = 0.0  # a positive amount that wants to be negative is none
        amount, covariance = evidence.fit(widths)
        amount[widths == 0.0] = 0.0
        on = np.flatnonzero(widths)
        chosen = [columns[int(j)] for j in on]
        exact = bench.blocks(chosen, {i: float(amount[j]) for i, j in enumerate(on)})
        linear = [_put(b, e, on) for b, e in zip(linear, exact, strict=True)]
        evidence = Evidence.of(linear, discrepancy)
    rest = tuple(bench.gap(k, combined(columns, dict(enumerate(amount)))) for k in range(len(linear)))
    return ArmFit(tuple(columns), groups, taken, amount, covariance, discrepancy, evidence, tuple(linear), rest)


def _put(block: ResidualBlock, exact: ResidualBlock, on: np.ndarray) -> ResidualBlock:
    X = block.X.copy()
    X[:, :, on] = exact.X
    return replace(block, X=X, N=exact.N, r=exact.r)


def _parts(blocks: Sequence[ResidualBlock]) -> list[ResidualBlock]:
    """What is withheld: whole campaigns, or regions of the only one."""
    if len(blocks) > 1:
        return list(blocks)
    b = blocks[0]
    group = regions(b.features, REGIONS)
    return [
        replace(b, features=b.features[m], X=b.X[m], N=b.N[m], r=b.r[m], alone=False)
        for m in (group == i for i in range(REGIONS))
        if m.any()
    ]


def _discrepancy(blocks: Sequence[ResidualBlock]) -> Discrepancy:
    """Discrepancy beside the richest model, from regions small enough to be quick."""
    size = max(float(np.sqrt(np.mean(np.concatenate([b.r.ravel() for b in blocks]) ** 2))), 1e-9)
    rough = Evidence.of(blocks, Discrepancy(0.0, 1.0, 0.3 * size))
    amount, _ = rough.fit(np.ones(rough.effects))
    features, rest = [], []
    for b in blocks:
        left = without_nuisance(b.r - b.X @ amount, b.N)
        group = regions(b.features, -(-len(left) // HYPER_POSES))
        for i in np.unique(group):
            features.append(b.features[group == i])
            rest.append(left[group == i])
    return fit_discrepancy(features, rest)


# -- the result -------------------------------------------------------------------------------------------------------


def _size(parts: Sequence[Floats]) -> float:
    every = np.concatenate(list(parts))
    return float(np.sqrt(np.mean((every**2).sum(axis=1))))


def _gap(gaps: Sequence[Floats], floor: float) -> GapSize:
    size = 1e3 * np.linalg.norm(np.concatenate(list(gaps)), axis=1)
    return GapSize(
        rms_um=_round(np.sqrt(np.mean(size**2))),
        p95_um=_round(np.quantile(size, 0.95)),
        max_um=_round(size.max()),
        noise_floor_um=_round(floor),
    )


def _causes(bench: ArmBench, found: ArmFit, gaps: Sequence[Floats], unknown_um: float | None) -> tuple[FoundCause, ...]:
    """Effects with the actuators that matter; shares by the order in which the groups were taken.

    unknown_um: size from which on a leftover is unknown, None where there is no such cause.
    """
    before = found.taken.none
    whole = float(np.mean(before.squares))
    full = found.evidence.value(np.where(found.amount != 0.0, found.taken.widths, 0.0))
    out: list[FoundCause] = []
    for step in found.taken.steps:
        share = (np.mean(before.squares) - np.mean(step.squares)) / whole
        sure = odds(step.density - before.density)
        own = [_target(found, step, target, full) for target in dict.fromkeys(_targets(found, step.group))]
        energy = sum(e for e, _, _ in own)
        for (e, probability, parameters), target in zip(own, dict.fromkeys(_targets(found, step.group)), strict=True):
            if probability >= LEAST_TARGET:
                out.append(
                    FoundCause(
                        effect=step.group,
                        target=target,
                        probability=stated(min(sure, probability)),
                        share=round(float(share * e / energy), 4),
                        parameters=parameters,
                    )
                )
        before = step
    order = [s.group for s in found.taken.steps]
    out.sort(key=lambda c: (-c.probability, order.index(c.effect), -c.share))
    if unknown_um is not None:
        squares = [1e6 * (r**2).sum(axis=1) for r in found.rest]
        features = [c.features for c in bench.campaigns]
        left = round(_size(found.rest) ** 2 / _size(gaps) ** 2, 4)
        out.append(UnknownCause(target=None, probability=exceeding(squares, features, unknown_um), share=left))
    return tuple(out)


def exceeding(squares: Sequence[Floats], features: Sequence[Floats], limit: float) -> float:
    """Probability that a leftover, squares (n,) um2 per campaign, is larger than a limit in um (rms).

    With regions of postures drawn anew, the share of draws in which it is: (hits + 1) / (draws + 2), Laplace's rule for
    an even prior, which is never surer than the number of draws allows.
    """
    energy, count = _by_region(squares, features), _by_region([np.ones(len(s)) for s in squares], features)
    pick = np.random.default_rng(CAMPAIGN_SEED).integers(0, len(energy), (DRAWS, len(energy)))
    hits = int((energy[pick].sum(axis=1) > limit**2 * count[pick].sum(axis=1)).sum())
    return stated((hits + 1) / (DRAWS + 2))


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
    return energy, odds(full - found.evidence.value(widths)), parameters


def _where(bench: ArmBench, gaps: Sequence[Floats], found: ArmFit, unknown: bool) -> Where:
    energy = (np.concatenate(list(gaps)) ** 2).sum(axis=0)
    actuators = dict.fromkeys(bench.actuators, 0.0)
    stages: dict[str, float] = {}
    for step in found.taken.steps:
        for target in dict.fromkeys(_targets(found, step.group)):
            size, _, _ = _target(found, step, target, 0.0)
            stage = next(c.module.STAGE for c in found.columns if c.effect == step.group)
            stages[stage] = stages.get(stage, 0.0) + size
            if target is not None:
                actuators[target] += size
    total = max(sum(actuators.values()), 1e-300)
    most: Any = max(stages, key=lambda s: stages[s]) if stages else "structure"
    whole = max(float(energy.sum()), 1e-300)
    return Where(
        stage=most,
        axes={axis: round(float(e) / whole, 4) for axis, e in zip("xyz", energy, strict=True)},
        actuators={name: round(size / total, 4) for name, size in actuators.items()},
        drivers=_drivers(bench, found) if unknown else (),
    )


def _drivers(bench: ArmBench, found: ArmFit) -> tuple[Driver, ...]:
    """What the leftover depends on."""
    patterns: dict[str, list[Floats]] = {}
    for k, campaign in enumerate(bench.campaigns):
        hung = bench.standing(campaign, ()).hung
        lever = bench.start[k].tips(hung.point, hung.rotation) - hung.point
        J = np.array([jacobian(bench.arm, q) for q in campaign.q])
        moves = J[:, :3] + np.cross(J[:, 3:], lever[:, :, None], axis=1)
        for a, drive in enumerate(bench.robot.actuators):
            own = moves[:, :, a]
            if drive.revolute:
                patterns.setdefault(f"position:{drive.name}", []).append(turns(own, campaign.q[:, a]))
                torque = hung.drive[:, a] / max(float(np.abs(hung.drive[:, a]).max()), 1e-9)
                pair = np.stack([torque, torque * np.abs(torque)], axis=1)
                patterns.setdefault(f"force:{drive.name}", []).append(3e-4 * own[:, :, None] * pair[:, None, :])
            else:
                span = np.ptp(campaign.q[:, a]) or 1.0
                patterns.setdefault(f"position:{drive.name}", []).append(
                    turns(own * 1e3, 2 * np.pi * campaign.q[:, a] / span)
                )
        slow = (campaign.time - campaign.time.mean()) / max(float(np.ptp(campaign.time)), 1e-9)
        wide = np.stack([slow, slow**2], axis=1)
        every = np.concatenate([np.eye(3)[None] * 0.3 * f[:, None, None] for f in wide.T], axis=2)
        patterns.setdefault("time", []).append(every)
    if all(c.temperature is not None and np.ptp(c.temperature) > 0.1 for c in bench.campaigns):
        patterns["temperature"] = [
            np.eye(3)[None] * 0.1 * (c.temperature - c.temperature.mean())[:, None, None]  # type: ignore[union-attr]
            for c in bench.campaigns
        ]
    every_share = shares(patterns, found.rest, [c.features for c in bench.campaigns], found.discrepancy.noise)
    return tuple(Driver(covariate=name, share=round(share, 4)) for name, share in every_share[:6] if share > 0.02)


def _shrinkage(bench: ArmBench | None, found: ArmFit, names: list[str]) -> UnseenShrinkage:
    """On held-out runs with their frames fitted again; without such runs, every block is withheld once."""
    groups = [s.group for s in found.taken.steps]
    if bench is not None:
        stages = _stages(bench, found)
        size = [_size(parts) for parts in stages]
        first = [(g**2).sum(axis=1) for g in stages[0]]
        last = [(g**2).sum(axis=1) for g in stages[-1]]
        low, high = _interval(first, last, [c.features for c in bench.campaigns])
    else:
        size = [rms(s.squares) for s in (found.taken.none, *found.taken.steps)]
        low, high = _resampled(found.taken.none.squares, (found.taken.steps or (found.taken.none,))[-1].squares)
    after = size[-1]
    ratio_value = 1.0 - after / size[0] if size[0] > 0 else 0.0
    return UnseenShrinkage(
        holdout=tuple(names),
        before_rms_um=_round(1e3 * size[0]),
        after_rms_um=_round(1e3 * after),
        ratio=round(ratio_value, 4),
        ci95=(round(min(low, ratio_value), 4), round(max(high, ratio_value), 4)),
        steps=tuple(
            ShrinkageStep(effect=g, target=None, after_rms_um=_round(1e3 * s))
            for g, s in zip(groups, size[1:], strict=True)
        ),
    )


def _stages(bench: ArmBench, found: ArmFit) -> list[list[Floats]]:
    """Gaps of campaigns with the first 0, 1, ... groups, frames fitted again."""
    groups = [s.group for s in found.taken.steps]
    return [
        [bench.gap(k, found.causes(groups[:i])) for k in range(len(bench.campaigns))] for i in range(len(groups) + 1)
    ]


def holding(found: ArmFit, judge: ArmBench) -> int:
    """How many groups, in their order, make a campaign that was held out smaller by LEAST_SHARE each.

    A veto only: what does not hold there is no cause, however well it explains the postures it was fitted on.
    """
    size = [_size(parts) for parts in _stages(judge, found)]
    for i in range(len(found.taken.steps)):
        if size[i + 1] > (1.0 - LEAST_SHARE) * size[i]:
            return i
    return len(found.taken.steps)


def shortened(found: ArmFit, count: int) -> Taken:
    """The first groups only."""
    widths = np.zeros(len(found.columns))
    for step in found.taken.steps[:count]:
        widths[found.groups[step.group]] = step.width
    return replace(found.taken, steps=found.taken.steps[:count], widths=widths)


def _interval(first: Sequence[Floats], last: Sequence[Floats], features: Sequence[Floats]) -> tuple[float, float]:
    """95 % interval of the ratio by drawing regions of postures, 16 per campaign, with replacement."""
    return _resampled(_by_region(first, features), _by_region(last, features))


def _by_region(values: Sequence[Floats], features: Sequence[Floats]) -> Floats:
    """Sums (r,) of values, each (n,), over regions of postures, 16 per campaign."""
    out = []
    for f, x in zip(features, values, strict=True):
        group = regions(f, 2 * REGIONS)
        out += [float(x[group == g].sum()) for g in np.unique(group)]
    return np.array(out)


def _resampled(before: Floats, after: Floats) -> tuple[float, float]:
    rng = np.random.default_rng(CAMPAIGN_SEED)
    pick = rng.integers(0, len(before), (DRAWS, len(before)))
    ratio = 1.0 - np.sqrt(after[pick].sum(axis=1) / np.maximum(before[pick].sum(axis=1), 1e-300))
    low, high = np.quantile(ratio, [0.025, 0.975])
    return float(low), float(high)


def _round(value: float) -> float:
    return round(float(value), 3)


def _digits(value: float) -> float:
    return float(f"{value:.6g}")
