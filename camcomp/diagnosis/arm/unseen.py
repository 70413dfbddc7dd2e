"""Static poses that took no part in the fit: whether they are at the floor, and how far their gap shrinks.

Withheld campaigns are judged by the fitted ones, else every run by the others; a run that is alone has no unseen poses. What
is judged has the frames of its clamping where fitted poses fix them; otherwise its frames are fitted again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.answer.unseen import JudgedRun, unseen_shrinkage
from camcomp.diagnosis.arm.case import PoseCase, named_rows
from camcomp.diagnosis.arm.curves import covered, seen_angles
from camcomp.diagnosis.arm.noise_floor import far_off
from camcomp.diagnosis.arm.poses import CURVE, LEAST_POSES
from camcomp.diagnosis.model.evidence import Background, LinearModel
from camcomp.diagnosis.model.folds import REGIONS, Excess, excess_of, folds_of
from camcomp.diagnosis.model.group import Group, split_regions
from camcomp.diagnosis.model.search import best_of, search_sets
from camcomp.diagnosis.result.types import FoundCause, UnknownCause, UnseenShrinkage
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats, Ints
from camcomp.model.effect import Cause

FAR_FRAME = 5.0  # contract: floors from which on withheld poses in fitted frames are warned of


UnseenPoses = tuple[LinearModel, list[tuple[int, Ints]]]  # one group per unit that is left out; its campaign and rows


def unseen_poses(case: PoseCase) -> UnseenPoses:
    """Withheld campaigns, else all runs."""
    bench, groups = case.bench, case.model.groups
    if len(bench.own) < len(bench.campaigns):
        judged = range(len(bench.own), len(bench.campaigns))
        return case.model, [(k, np.arange(len(groups[k].y))) for k in judged]
    units = []
    for k, poses in enumerate(bench.campaigns):
        names = np.unique(poses.run, return_inverse=True)[1]
        units += [(k, np.flatnonzero(names == i)) for i in np.unique(names)]
    return replace(case.model, groups=tuple(groups[k].take(rows) for k, rows in units), fitted=None), units


def check_held_out(case: PoseCase, model: LinearModel) -> Excess | None:
    """Excess of held-out poses with the causes, under the noise of the floor alone; None without either of them."""
    pairs = folds_of(model)
    if case.floor is None or not all(others for _, others in pairs):
        return None
    found = case.explanation
    background = Background(families=found.background.families)
    return excess_of(model, background, found.members, pairs, case.floor.freedom)


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
    bench = bench.having(campaigns, bench.fitted)
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
    case: PoseCase, unseen: UnseenPoses, named: Sequence[FoundCause], names: Sequence[str], withheld: bool
) -> UnseenShrinkage | None:
    """Shrinkage of withheld campaigns, else of every run by causes fitted to the others; None where one run is all."""
    bench, (model, units) = case.bench, unseen
    known = [c for c in named if not isinstance(c, UnknownCause)]
    if not units or (not withheld and len(case.runs) == 1):
        return None
    if withheld:
        stages = [[bench.gap(k, acting(known[:i])) for i in range(len(known) + 1)] for k, _ in units]
        order = [(c.effect, c.target) for c in known]
        refitted = any(bench.owner[k] == k for k, _ in units)
    else:
        stages, order, refitted = left_out_in_turn(model, case.explanation.background)
    runs = []
    for (k, rows), each in zip(units, stages, strict=True):
        parts = split_regions(bench.features(bench.campaigns[k])[rows], min(REGIONS, max(len(rows) // 8, 2)))
        runs.append(JudgedRun([(r**2).sum(axis=1) for r in each], parts))
    share, rest = where_covered(case, named, units, [r.squares[-1] for r in runs])
    texts = ["frame of the instrument", "place of its target"] if refitted else []
    texts += [f"run {name} does not fix its frame: not judged" for name in case.loose]
    return unseen_shrinkage(
        runs, order, holdout=tuple(names), noise_floor_um=None if case.floor is None else round(case.floor.um, 3),
        refitted=tuple(texts), covered_share=share, covered_rms_um=rest,
    )  # fmt: skip


def left_out_in_turn(
    model: LinearModel, background: Background
) -> tuple[list[list[Floats]], list[tuple[str, str | None]], bool]:
    """Residuals (n, 3) of every group after 0, 1, ... causes that the others have, the causes in order, and whether a
    group had its frames fitted again.
    """
    order: list[tuple[str, str | None]] = []
    every: list[list[Floats]] = []
    refitted = False
    for g, others in folds_of(model):
        less = replace(model, fitted=others)
        members = best_of(search_sets(less.reduced(background)))
        at = less.posterior(background, less.reduced(background).slab(members))
        own = {model.candidates[i].place: list(model.candidates[i].columns) for i in members}
        own |= {(name, None): less.family(name)[0].tolist() for name, _ in background.families}
        order += [place for place in own if place not in order]
        mates = [model.groups[i] for i in others if model.groups[i].label == model.groups[g].label]
        alone = not fix_frames(mates, model.groups[g])
        refitted |= alone
        stages = []
        for i in range(len(order) + 1):
            on = [j for place in order[:i] for j in own.get(place, [])]
            stages.append(in_frames(model.groups[g], [model.groups[g]] if alone else mates, on, at.mean[on]))
        every.append(stages)
    return [[*each, *each[-1:] * (len(order) + 1 - len(each))] for each in every], order, refitted


def fix_frames(others: Sequence[Group], group: Group) -> bool:
    """Whether frames fitted to other groups of a clamping err less than a pose of the group does by itself."""
    if sum(len(each.y) for each in others) < LEAST_POSES:
        return False
    fitted = np.concatenate([each.N for each in others]).reshape(-1, group.N.shape[2])
    moved = group.N.reshape(-1, group.N.shape[2]) @ np.linalg.pinv(fitted)
    return float((moved**2).sum()) < group.y.size


def in_frames(group: Group, fixed_by: Sequence[Group], on: Sequence[int], amount: Floats) -> Floats:
    """Residual (n, 3) of a group with columns at their amounts, in the frames that fit best to other groups of its label."""
    y, A, N = (np.concatenate([getattr(g, name) for g in fixed_by]) for name in ("y", "A", "N"))
    frame = np.linalg.lstsq(N.reshape(-1, N.shape[2]), (y - A[:, :, on] @ amount).ravel(), rcond=1e-10)[0]
    return np.asarray(group.y - group.A[:, :, on] @ amount - group.N @ frame, float)


def where_covered(
    case: PoseCase, named: Sequence[FoundCause], units: Sequence[tuple[int, Ints]], after: Sequence[Floats]
) -> tuple[float | None, float | None]:
    """Share of unseen poses whose joints with an error curve lie in its measured range, and the rms residual there, um."""
    bench = case.bench
    joints = sorted({bench.actuators.index(str(c.target)) for c in named if c.effect == CURVE})
    if not joints:
        return None, None
    inside = []
    for k, rows in units:
        others = [np.delete(bench.campaigns[i].q, rows, axis=0) if i == k else bench.campaigns[i].q for i in bench.own]
        q = np.concatenate(others)
        inside.append(covered({a: seen_angles(q[:, a]) for a in joints}, bench.campaigns[k].q[rows]))
    every = np.concatenate([left[mask] for left, mask in zip(after, inside, strict=True)])
    rest = round(1e3 * float(np.sqrt(every.mean())), 3) if len(every) else None
    return round(len(every) / sum(len(left) for left in after), 4), rest
