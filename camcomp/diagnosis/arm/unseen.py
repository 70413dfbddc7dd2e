"""Static poses that took no part in the fit: whether they are at the floor, and how far their gap shrinks.

Withheld campaigns are judged by the fitted ones, else every campaign by the others; one campaign alone has no unseen poses.
A withheld campaign with the clamping of a fitted one has its frames; one with a clamping of its own has them fitted again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.answer.unseen import PARTS, JudgedRun, unseen_shrinkage
from camcomp.diagnosis.arm.case import PoseCase, named_rows
from camcomp.diagnosis.arm.curves import covered, seen_angles
from camcomp.diagnosis.arm.noise_floor import far_off
from camcomp.diagnosis.arm.poses import CURVE, ArmBench
from camcomp.diagnosis.model.evidence import Background
from camcomp.diagnosis.model.folds import Excess, excess_of, folds_of, held_out, without_nuisances
from camcomp.diagnosis.model.group import split_regions
from camcomp.diagnosis.model.search import MOST, search_sets
from camcomp.diagnosis.result.types import FoundCause, UnknownCause, UnseenShrinkage
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause

FAR_FRAME = 5.0  # contract: floors from which on withheld poses in fitted frames are warned of


def check_held_out(case: PoseCase) -> Excess | None:
    """Excess of held-out campaigns with the causes, under the noise of the floor alone; None without either of them."""
    if len(case.bench.campaigns) < 2 or case.floor is None:
        return None
    found = case.explanation
    background = Background(families=found.background.families)
    parts = held_out(case.model, background, found.members, folds_of(case.model))
    return excess_of(case.model, parts, case.floor.freedom)


def without_far_judged(case: PoseCase) -> PoseCase:
    """The case without withheld poses that are outliers of the fitted causes."""
    bench, causes = case.bench, case.causes
    campaigns, groups, outliers = list(bench.campaigns), list(case.model.groups), list(case.outliers)
    for k in range(len(bench.own), len(campaigns)):
        far = far_off(np.linalg.norm(bench.gap(k, causes), axis=1), campaigns[k].time)
        outliers += named_rows(campaigns[k], far)
        campaigns[k], groups[k] = campaigns[k].take(~far), groups[k].take(~far)
    if len(outliers) == len(case.outliers):
        return case
    model = replace(case.model, groups=tuple(groups))
    bench = ArmBench(robot=bench.robot, causes=bench.causes, campaigns=campaigns, fitted=bench.fitted)
    return replace(case, bench=bench, explanation=replace(case.explanation, model=model), outliers=tuple(outliers))


def acting(named: Sequence[FoundCause]) -> list[Cause]:
    """Causes as the written machine file has them."""
    return [
        Cause(
            each.effect, shelf.load("effects", each.effect), each.target,
            {name: value.value for name, value in each.parameters.items()} | each.settings,
        )
        for each in named
        if not isinstance(each, UnknownCause)
    ]  # fmt: skip


def notes_of_frames(case: PoseCase, named: Sequence[FoundCause]) -> tuple[str, ...]:
    """Warnings about withheld runs that lie far off in fitted frames, or do not fix their own."""
    out = [f"run '{name}' does not fix its frame and is not judged" for name in case.loose]
    bench, causes = case.bench, acting(named)
    for k in range(len(bench.own), len(bench.campaigns)):
        if bench.owner[k] == k or case.floor is None:
            continue
        size = float(np.sqrt(np.mean((bench.gap(k, causes) ** 2).sum(axis=1))))
        if 1e3 * size > FAR_FRAME * case.floor.um:
            out.append(
                f"withheld run '{bench.campaigns[k].run[0]}' lies {size:.3g} mm off in the frames of the fitted runs: "
                "write `clamping:` with a label of its own where its instrument or target was set up anew"
            )
    return tuple(out)


# -- shrinkage ----------------------------------------------------------------------------------------------------------


def shrinkage(
    case: PoseCase, named: Sequence[FoundCause], names: Sequence[str], withheld: bool
) -> UnseenShrinkage | None:
    """Shrinkage of withheld campaigns by causes that were fitted to the others; None where all campaigns are fitted."""
    bench = case.bench
    known = [c for c in named if not isinstance(c, UnknownCause)]
    if withheld:
        judged = tuple(range(len(bench.own), len(bench.campaigns)))
        stages = [[bench.gap(k, acting(known[:i])) for i in range(len(known) + 1)] for k in judged]
        order = [(c.effect, c.target) for c in known]
    else:
        judged = bench.own if len(bench.own) > 1 else ()
        stages, order = left_out_in_turn(case)
    if not judged:
        return None
    runs = []
    for k, each in zip(judged, stages, strict=True):
        count = min(PARTS, max(len(each[0]) // 8, 2))
        parts = split_regions(bench.campaigns[k].features, count)
        runs.append(JudgedRun([(r**2).sum(axis=1) for r in each], parts))
    share, rest = where_covered(case, named, judged, [r.squares[-1] for r in runs])
    refitted = [k for k in judged if bench.owner[k] == k]
    texts = [] if not refitted else ["frame of the instrument", "place of its target"]
    texts += [f"run {name} does not fix its frame: not judged" for name in case.loose]
    return unseen_shrinkage(
        runs, order, holdout=tuple(names), noise_floor_um=None if case.floor is None else round(case.floor.um, 3),
        refitted=tuple(texts), covered_share=share, covered_rms_um=rest,
    )  # fmt: skip


def left_out_in_turn(case: PoseCase) -> tuple[list[list[Floats]], list[tuple[str, str | None]]]:
    """Residuals (n, 3) of every campaign after 0, 1, ... causes that the others have, and the causes in order."""
    model, background, candidates = case.model, case.explanation.background, case.model.candidates
    order: list[tuple[str, str | None]] = []
    every: list[list[Floats]] = []
    for g, others in folds_of(model) if len(case.bench.own) > 1 else ():
        less = replace(model, fitted=others)
        members = search_sets(less.reduced(background), MOST).best
        at = less.posterior(background, less.reduced(background).slab(members))
        own = {candidates[i].place: list(candidates[i].columns) for i in members}
        own |= {(name, None): less.family(name)[0].tolist() for name, _ in background.families}
        order += [place for place in own if place not in order]
        group = model.groups[g]
        left, stages = group.y, [without_nuisances(group.y, group.N)]
        for place in order:
            on = own.get(place, [])
            left = left - group.A[:, :, on] @ at.mean[on]
            stages.append(without_nuisances(left, group.N))
        every.append(stages)
    return [[*each, *each[-1:] * (len(order) + 1 - len(each))] for each in every], order


def where_covered(
    case: PoseCase, named: Sequence[FoundCause], judged: Sequence[int], after: Sequence[Floats]
) -> tuple[float | None, float | None]:
    """Share of withheld poses whose joints with an error curve lie in its measured range, and the rms residual there,
    um.
    """
    bench = case.bench
    joints = sorted({bench.actuators.index(str(c.target)) for c in named if c.effect == CURVE})
    if not joints:
        return None, None
    inside = []
    for k in judged:
        q = np.concatenate([bench.campaigns[i].q for i in bench.own if i != k])
        inside.append(covered({a: seen_angles(q[:, a]) for a in joints}, bench.campaigns[k].q))
    every = np.concatenate([left[mask] for left, mask in zip(after, inside, strict=True)])
    rest = round(1e3 * float(np.sqrt(every.mean())), 3) if len(every) else None
    return round(len(every) / sum(len(left) for left in after), 4), rest
