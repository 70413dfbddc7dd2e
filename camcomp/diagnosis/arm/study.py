"""Why an arm's measured poses differ from its model: causes that hold for campaigns they were not fitted on.

Inside one campaign many effects explain the same poses; with other poses most of them make it worse. So groups of
effects are judged by campaigns that are withheld, or by regions of postures where there is only one campaign (which then
can be no more than ambiguous), and what no group predicts is stated as unknown, with what it depends on. Whether
something is left is a matter of the floor: measured by repeats, or stated, and never what a fit leaves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from camcomp.diagnosis.arm import answer
from camcomp.diagnosis.arm.curves import with_curves
from camcomp.diagnosis.arm.discrepancy import Discrepancy
from camcomp.diagnosis.arm.fit import ArmFit, fitted, investigate, named_rows
from camcomp.diagnosis.arm.gate import Gate, judge, unseen
from camcomp.diagnosis.arm.noise_floor import StatedDeviation, TipFloor, far_off, tip_floor
from camcomp.diagnosis.arm.pose_values import of_poses
from camcomp.diagnosis.arm.poses import CURVE, ArmBench, Poses
from camcomp.diagnosis.arm.unseen import (
    Court,
    Rival,
    adopted,
    beside_curves,
    borne_out,
    court,
    court_of_curves,
    holding,
    rivals,
    shrinkage,
)
from camcomp.diagnosis.result.types import UNKNOWN, DiagnosisResult, Floor, Outlier
from camcomp.ground import headway
from camcomp.ground.datatypes import Floats
from camcomp.ground.headway import part
from camcomp.model.effect import Cause
from camcomp.model.statics.description import Robot

MOST_POSES = 1200  # of a campaign; more are drawn from
LEAST_POSES = 12  # of a campaign; fewer do not even tell its frames
CAMPAIGN_SEED = 20200714  # drawing has to give the same answer twice


def study(
    robot: Robot,
    causes: Sequence[Cause],
    runs: Sequence[Poses],
    *,
    holdout: Sequence[str] = (),
    without: Sequence[str] = (),
    stated: StatedDeviation | None = None,
) -> DiagnosisResult:
    """Result for static poses of an arm. runs: one entry per run, whose label is its campaign (clamping).

    holdout: names of runs (`Poses.run`) that are judged and never fitted; only their frames are. Raises ValueError when
    a campaign has too few poses for its frames.
    """
    fitted_runs = [r for r in runs if str(r.run[0]) not in holdout]
    if not fitted_runs:
        raise ValueError("every run is held out")
    own, more = merged(fitted_runs), merged([r for r in runs if str(r.run[0]) in holdout])
    every, gaps, outliers = _cleaned(robot, tuple(causes), [*own, *more])
    floor = tip_floor(robot, every, gaps, StatedDeviation() if stated is None else stated)
    values = of_poses(robot, every, gaps)
    every = [drawn(each) for each in every]
    bench = ArmBench(robot, tuple(causes), every[: len(own)])
    with part(0.0, 0.3):
        found = investigate(bench, without)
    outliers += found.outliers
    held = ArmBench(robot, tuple(causes), every[len(own) :]) if more else None
    if held is not None:
        outliers += _without_outliers(held, found)
    with part(0.3, 0.7):
        curved = found if CURVE in without else with_curves(bench, found)
    judges = court(bench, found, held)
    curve_judges = court_of_curves(judges, bench, curved, held)
    seen_names = sorted({str(r.run[0]) for r in runs if not holdout or str(r.run[0]) in holdout})
    shrunk = shrinkage(curve_judges, curved, seen_names, bench)
    floor_mm = None if floor is None else 1e-3 * floor.um
    sets = rivals(judges, found, floor_mm)
    kept = holding(judges, found) if held is not None else found.taken
    if judges.whole and kept is found.taken and (best := max(sets, key=lambda s: s.density)) is not sets[0]:
        kept = adopted(found, best)
    if [s.group for s in kept.steps] != [s.group for s in found.taken.steps]:
        chosen = found.chosen if held is not None else kept
        found = replace(
            fitted(bench, found.columns, found.groups, found.linear, found.discrepancy, kept), chosen=chosen
        )
        judges = court(bench, found, held)
        sets = rivals(judges, found, floor_mm)
        if curved.rough is not None:
            curved = replace(with_curves(bench, found), chosen=curved.chosen)
            curve_judges = court_of_curves(judges, bench, curved, held)
    if curved.rough is not None:
        if held is None or borne_out(curve_judges, curved):
            found, judges, sets = curved, curve_judges, beside_curves(sets, curved)
        else:
            found = replace(found, chosen=curved.chosen)
    headway.done(0.75)
    gate = _gate(bench, held, found, judges, floor)
    word = verdict(found, judges, gate, sets)
    first = [bench.gap(k, ()) for k in range(len(bench.campaigns))]
    told = answer.Told(bench, found, gate, floor, sets, word, judges)
    headway.done(0.8)
    named, minor = answer.causes(told, first)
    headway.done(0.9)
    if word == "identified" and not named:  # all that was taken turned out minor
        word = "none"
    known = any(c.effect != UNKNOWN for c in named)
    return DiagnosisResult(
        verdict=word,
        gap=answer.gap(first, floor),
        where=answer.where(told, first),
        causes=named,
        alternatives=answer.alternatives(told, named)
        if word == "ambiguous" or (word == "unknown" and known and len(sets) > 1)
        else (),
        shrinkage=shrunk,
        minor=minor,
        next_experiment=answer.next_experiment(told),
        floor=Floor(um=round(floor.um, 3), source=floor.source) if floor else Floor(um=None, source="not identifiable"),
        outliers=tuple(Outlier(run=run, row=row) for run, row in sorted(set(outliers))),
        standards=values,
    )


def verdict(found: ArmFit, judges: Court, gate: Gate, sets: Sequence[Rival]) -> Any:
    """The word. More data can make it firmer and less data only looser: what is not shown is not said.

    `unknown`: more than the floor is left, or where there is no floor, a leftover that follows something. One campaign
    without a floor cannot tell an unknown from the freedom of a fit, and stays `ambiguous`.
    """
    if gate.word == "above" and (judges.whole or gate.floor or not found.taken.steps):
        return "unknown"
    if not found.taken.steps:
        return "none" if gate.word == "at" else "ambiguous"
    as_chosen = {s.group for s in found.taken.steps} == {s.group for s in found.chosen.steps}
    # otherwise the unseen campaigns had a say, and judge no more
    sure = gate.word == "at" and judges.whole and len(sets) == 1 and as_chosen
    return "identified" if sure else "ambiguous"


def merged(runs: Sequence[Poses]) -> list[Poses]:
    """One entry per campaign, its poses and the campaigns in an order of their own, and no row twice."""
    out = []
    for label in dict.fromkeys(r.label for r in runs):
        own = [r for r in runs if r.label == label]
        heats, deviations = [r.temperature for r in own], [r.sd for r in own]
        heat = None if any(h is None for h in heats) else np.concatenate([h for h in heats if h is not None])
        sd = np.concatenate([np.full((len(r.q), 3), np.nan) if r.sd is None else r.sd for r in own])
        q, tip, time, run, row = (
            np.concatenate([getattr(r, f) for r in own]) for f in ("q", "tip", "time", "run", "rows")
        )
        way = np.concatenate([np.zeros_like(r.q) if r.approach is None else r.approach for r in own])
        every = Poses(label, q, tip, time, heat, run, None if all(d is None for d in deviations) else sd, row, way)
        _, first = np.unique(np.concatenate([q, tip], axis=1), axis=0, return_index=True)  # sorted by joints
        every = every.take(first)
        if len(every.q) < LEAST_POSES:
            raise ValueError(f"campaign '{label}' has {len(every.q)} poses; its frames alone need more")
        out.append(every)
    return sorted(out, key=lambda each: tuple(each.q[0]))


def drawn(poses: Poses) -> Poses:
    """At most MOST_POSES poses, drawn evenly."""
    n = len(poses.q)
    if n <= MOST_POSES:
        return poses
    return poses.take(np.sort(np.random.default_rng(CAMPAIGN_SEED).choice(n, MOST_POSES, replace=False)))


def _cleaned(
    robot: Robot, causes: tuple[Cause, ...], campaigns: Sequence[Poses]
) -> tuple[list[Poses], list[Floats], list[tuple[str, int]]]:
    """Campaigns without poses far off their nominal model, their gaps (n, 3) mm to it, and runs and rows of the others."""
    out, gaps, outliers = [], [], []
    for each in campaigns:
        for _ in range(3):
            bench = ArmBench(robot, causes, [drawn(each)])
            frame = bench.registration(0, ())
            gap = frame.to_machine(each.tip) - bench.standing(each, ()).tips(frame)
            far = far_off(np.linalg.norm(gap, axis=1))
            outliers += named_rows(each, far)
            each, gap = each.take(~far), gap[~far]
            if not far.any():
                break
        out.append(each)
        gaps.append(gap)
    return out, gaps, outliers


def _without_outliers(held: ArmBench, found: ArmFit) -> list[tuple[str, int]]:
    """Takes poses far off, with the causes in, from campaigns that are held out; their runs and rows."""
    campaigns, outliers = list(held.campaigns), []
    for k, each in enumerate(campaigns):
        far = far_off(np.linalg.norm(held.gap(k, found.causes()), axis=1))
        outliers += named_rows(each, far)
        campaigns[k] = each.take(~far)
    held.campaigns = campaigns
    return outliers


def _gate(bench: ArmBench, held: ArmBench | None, found: ArmFit, judges: Court, floor: TipFloor | None) -> Gate:
    """What is left on unseen poses against the floor, or where there is none, against what depends on nothing."""
    sd = floor.sd if floor else max(float(np.sqrt(np.mean(np.concatenate(found.rest) ** 2))), 1e-9)
    evidence = judges.evidence(Discrepancy(0.0, 1.0, sd))
    widths = np.where(found.amount != 0.0, found.taken.widths, 0.0)
    left = unseen(evidence, widths, sd)
    patterns = answer.patterns(held or bench, judges.poses)
    return judge(left, floor, [p.features for p in judges.poses], [p.time for p in judges.poses], patterns)
