"""Why an arm's measured poses differ from its model: causes that hold for campaigns they were not fitted on.

A few causes at single joints are asked for first. Where they are not all, an arm may be off everywhere: inside one campaign
many effects explain the same poses, with other poses most of them make it worse. So groups of effects are judged by campaigns
that are withheld, or by regions of postures where there is only one campaign (which then can be no more than ambiguous), and
what none predicts is stated as unknown, with what it depends on. Whether something is left is a matter of the floor: measured
by repeats, or stated, and never what a fit leaves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from camcomp.diagnosis.arm import answer
from camcomp.diagnosis.arm.cases import CLOSE, ArmCase, at_floor, solved
from camcomp.diagnosis.arm.few_fit import Suspects, suspects
from camcomp.diagnosis.arm.fit import ArmFit, Prepared, named_rows, prepared
from camcomp.diagnosis.arm.gate import Gate
from camcomp.diagnosis.arm.noise_floor import StatedDeviation, TipFloor, far_off, least_floor, tip_floor
from camcomp.diagnosis.arm.pose_values import of_poses
from camcomp.diagnosis.arm.poses import ArmBench, Poses
from camcomp.diagnosis.arm.unseen import (
    Court,
    Rival,
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
    values = of_poses(robot, every, gaps)
    deviation = StatedDeviation() if stated is None else stated
    floor = least_floor(robot, every, gaps, deviation)
    whole, every = every, [drawn(each) for each in every]
    bench = ArmBench(robot, tuple(causes), every[: len(own)])
    held = ArmBench(robot, tuple(causes), every[len(own) :]) if more else None
    with part(0.0, 0.05):
        start = prepared(bench, without)
    outliers += start.outliers
    wanted = suspects(bench, start, without)
    with part(0.05, 0.4):
        case = solved(bench, held, start, wanted, floor, without)
    if floor is not None:
        acting = case.found.causes()
        beside = [_gap(robot, tuple(causes), each, acting) for each in whole]
        both = [tip_floor(robot, whole, gap, deviation) for gap in (gaps, beside)]
        shown = min((one for one in both if one), key=lambda one: one.sd, default=floor)
        with part(0.4, 0.75):
            case, floor = _settled(bench, held, start, wanted, without, case, floor, shown)
    outliers += case.outliers
    found, judges, sets, gate = case.found, case.judges, case.sets, case.gate
    seen_names = sorted({str(r.run[0]) for r in runs if not holdout or str(r.run[0]) in holdout})
    shrunk = shrinkage(case.seen_by, case.chosen, seen_names, bench)
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


def _settled(
    bench: ArmBench, held: ArmBench | None, start: Prepared, wanted: Suspects, without: Sequence[str], case: ArmCase,
    floor: TipFloor, shown: TipFloor,
) -> tuple[ArmCase, TipFloor]:  # fmt: skip
    """A case found at the least floor there may be, and that floor; or what is found at the one that repeats show beside it.

    What follows something at the lower one, and would be hidden by the higher one, is no noise: it is in the repeats as well.
    """
    if shown.sd <= CLOSE * floor.sd:
        return case, shown
    if case.found.few is None:
        again = at_floor(bench, held, case, shown)
    else:
        again = solved(bench, held, start, wanted, shown, without)
    hidden = case.gate.word == "above" and case.gate.structured and again.gate.word != "above"
    return (case, floor) if hidden else (again, shown)


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


def _gap(robot: Robot, causes: tuple[Cause, ...], poses: Poses, found: Sequence[Cause]) -> Floats:
    """Measured minus modelled tips (n, 3) of a campaign with what was found, its frame from some poses where they are many."""
    bench = ArmBench(robot, causes, [drawn(poses)])
    frame = bench.registration(0, found)
    return frame.to_machine(poses.tip) - bench.standing(poses, found).tips(frame)


def _cleaned(
    robot: Robot, causes: tuple[Cause, ...], campaigns: Sequence[Poses]
) -> tuple[list[Poses], list[Floats], list[tuple[str, int]]]:
    """Campaigns without poses far off their nominal model, their gaps (n, 3) mm to it, and runs and rows of the others."""
    out, gaps, outliers = [], [], []
    for each in campaigns:
        for _ in range(3):
            gap = _gap(robot, causes, each, ())
            far = far_off(np.linalg.norm(gap, axis=1), each.time)
            outliers += named_rows(each, far)
            each, gap = each.take(~far), gap[~far]
            if not far.any():
                break
        out.append(each)
        gaps.append(gap)
    return out, gaps, outliers
