"""What is judged on poses that took no part in choosing: sets of groups and their rivals, and how far the gap shrinks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from camcomp.diagnosis.arm.curves import covered, curved_joints, curves_taken, seen_angles, without_waves
from camcomp.diagnosis.arm.discrepancy import (
    Discrepancy,
    Evidence,
    Fold,
    ResidualBlock,
    each_withheld,
    regions,
    without_nuisance,
)
from camcomp.diagnosis.arm.few_causes import sways
from camcomp.diagnosis.arm.fit import ArmFit, masks, parts, relinearised
from camcomp.diagnosis.arm.forward_selection import (
    LEAST_GAIN,
    LEAST_SHARE,
    Taken,
    best_width,
    in_order,
    rms,
    take,
)
from camcomp.diagnosis.arm.noise_floor import SWAYS
from camcomp.diagnosis.arm.poses import CURVE, ArmBench, Poses
from camcomp.diagnosis.result.types import ShrinkageStep, UnseenShrinkage
from camcomp.diagnosis.statistics.one_more import log_ratio, of_one_more, scatter
from camcomp.ground.datatypes import Floats

# Sets of one campaign that leave up to this many times as much: effects that differ by 6 % of the rms within a campaign
# of the UR10 differ by a factor of two on the next one.
AT_FLOOR = 1.25  # of the floor: as good as it, because floors are known to no better
ALIKE_INSIDE = 2.0
MOST_SETS = 4
REGIONS = 16  # of postures per campaign
REGIONS_OF_ONE = 4  # that a campaign visits, at least: it differs from the next one by as much as means of these


@dataclass(frozen=True, eq=False)
class Court:
    """Blocks, of which the folds are judged. poses: of every fold; whole: whether folds are campaigns that were not fitted."""

    blocks: tuple[ResidualBlock, ...]
    folds: tuple[Fold, ...]
    poses: tuple[Poses, ...]
    whole: bool

    def evidence(self, discrepancy: Discrepancy) -> Evidence:
        """The folds under a discrepancy."""
        return Evidence.of(self.blocks, discrepancy, self.folds)


def court(bench: ArmBench, found: ArmFit, held: ArmBench | None) -> Court:
    """Held-out campaigns by the others; else every campaign by the others; else regions of the only one."""
    own = list(found.linear)
    if held is not None:
        more = relinearised(held, found.columns, held.blocks(found.columns), found.amount)
        more = [
            replace(b, frame=len(own) + k).loosened(without_nuisance(b.r - b.X @ found.amount, b.N))
            for k, b in enumerate(more)
        ]
        folds = tuple(Fold(len(own) + k, tuple(range(len(own)))) for k in range(len(more)))
        return Court((*own, *more), folds, tuple(held.campaigns), True)
    poses = tuple(bench.campaigns[k].take(mask) for k, mask in masks(own))
    blocks = tuple(parts(own))
    return Court(blocks, each_withheld(len(blocks)), poses, len(own) > 1)


def court_of_curves(judges: Court, bench: ArmBench, found: ArmFit, held: ArmBench | None) -> Court:
    """The court of a fit without waves of joints for the same fit, which may have them."""
    if CURVE not in found.groups:  # beside other causes they were worth nothing
        return judges
    if held is None:
        return court(bench, found, None)
    own, waves = len(found.linear), [found.columns[j] for j in found.groups[CURVE]]
    more = []
    for b, w in zip(judges.blocks[own:], held.blocks(waves), strict=True):
        wide = replace(b, X=np.concatenate([b.X, w.X], axis=2))
        more.append(wide.loosened(without_nuisance(wide.r - wide.X @ found.amount, wide.N)))
    return replace(judges, blocks=(*found.linear, *more))


def beside_sways(court: Court, sd: float) -> Court:
    """With slow waves in time behind the columns of every fold's block, as columns of its own."""
    own = [fold.block for fold in court.folds]
    more = 3 * SWAYS * len(own)
    blocks = []
    for i, b in enumerate(court.blocks):
        X = np.concatenate([b.X, np.zeros((*b.r.shape, more))], axis=2)
        if i in own:
            k = own.index(i)
            at = b.X.shape[2] + 3 * SWAYS * k
            X[:, :, at : at + 3 * SWAYS] = sways(court.poses[k].time, sd)
        blocks.append(replace(b, X=X))
    return replace(court, blocks=tuple(blocks))


@dataclass(frozen=True)
class Rival:
    """A set of groups with the widths (k,) of its columns, log predictive density and rms mm on the folds."""

    groups: tuple[str, ...]
    widths: tuple[float, ...]
    density: float
    left: float


def holding(court: Court, found: ArmFit) -> Taken:
    """Of the groups taken, those that a held-out campaign bears out: each has to lower its rms by LEAST_SHARE.

    Groups go one by one or together, whichever leaves least.
    """
    names = [s.group for s in found.taken.steps]
    evidence = court.evidence(found.discrepancy)
    best, kept = np.inf, found.taken
    for count in range(len(names) + 1):
        for some in combinations(names, count):
            taken = only(found, some)
            price = rms(evidence.predict(taken.widths)[1]) / (1.0 - LEAST_SHARE) ** count
            if price < best:
                best, kept = price, taken
    return found.taken if len(kept.steps) == len(names) else kept


def only(found: ArmFit, names: Sequence[str]) -> Taken:
    """Some of the groups taken."""
    steps = tuple(s for s in found.taken.steps if s.group in names)
    kept = [j for step in steps for j in found.groups[step.group]]
    widths = np.where(np.isin(np.arange(len(found.columns)), kept), found.taken.widths, 0.0)
    return replace(found.taken, steps=steps, widths=widths)


def rivals(court: Court, found: ArmFit, floor_mm: float | None) -> list[Rival]:
    """The set taken, and those that explain the folds alike, the set taken first.

    Tried are the set with one group less, with one of them exchanged for another, and every group alone. Where campaigns
    were withheld, alike is what no gain in density separates. Within one campaign density separates what the next one
    would not: there, sets are alike that all come down to the floor, or that leave no more than ALIKE_INSIDE times as much.
    """
    evidence = court.evidence(found.discrepancy)
    chosen = tuple(s.group for s in found.taken.steps)
    sets = {chosen: _rival(evidence, chosen, found.taken.widths)}
    for i in range(len(chosen)):
        less = (*chosen[:i], *chosen[i + 1 :])
        widths = found.taken.widths.copy()
        widths[found.groups[chosen[i]]] = 0.0
        for other in (None, *found.groups):
            names = less if other is None else (*less, other)
            if names and other not in chosen:
                sets[names] = _tried(evidence, found, names, widths, other)
    if not court.whole and chosen:
        for name in found.groups:
            sets[(name,)] = _tried(evidence, found, (name,), np.zeros(len(found.columns)), name)
    first = sets.pop(chosen)
    if court.whole:
        close = [s for s in sets.values() if s.density > first.density - LEAST_GAIN]
    else:
        none = _rival(evidence, (), np.zeros(len(found.columns)))
        least = min([first.left, *(s.left for s in sets.values())])
        near = 1.0 + LEAST_SHARE if floor_mm is not None and least < AT_FLOOR * floor_mm else ALIKE_INSIDE
        close = [s for s in sets.values() if s.left < min(near * least, (1.0 - LEAST_SHARE) * none.left)]
    unlike = {frozenset(first.groups): first}
    for each in sorted(close, key=lambda s: -s.density if court.whole else (len(s.groups), s.left)):
        unlike.setdefault(frozenset(each.groups), each)
    return list(unlike.values())[:MOST_SETS]


def adopted(found: ArmFit, rival: Rival) -> Taken:
    """What was taken, as a rival has it."""
    some = [(g, max(rival.widths[j] for j in found.groups[g])) for g in rival.groups]
    steps = in_order(Evidence.of(parts(found.linear), found.discrepancy), found.groups, some)
    return replace(found.taken, steps=tuple(steps), widths=np.array(rival.widths))


def _tried(evidence: Evidence, found: ArmFit, names: tuple[str, ...], widths: Floats, other: str | None) -> Rival:
    if other is None:
        return _rival(evidence, names, widths)
    step = best_width(evidence, widths, other, found.groups[other])
    more = widths.copy()
    more[found.groups[other]] = step.width
    return Rival(names, tuple(more), step.density, rms(step.squares))


def _rival(evidence: Evidence, names: tuple[str, ...], widths: Floats) -> Rival:
    density, squares = evidence.predict(widths)
    return Rival(names, tuple(widths), density, rms(squares))


def alike(court: Court, found: ArmFit) -> list[Rival]:
    """The sets that few causes leave, the most probable first."""
    assert found.few is not None
    evidence = court.evidence(found.discrepancy)
    out = []
    for names in found.few.sets:
        widths = np.zeros(len(found.columns))
        for name in names:
            widths[found.groups[name]] = 1.0
        out.append(_rival(evidence, names, widths))
    return out[:MOST_SETS]


def beside_curves(sets: Sequence[Rival], found: ArmFit) -> list[Rival]:
    """Sets that were compared without waves of joints, with those of the fit beside each of them."""
    step = next((s for s in found.taken.steps if s.group == CURVE), None)
    if step is None:
        return list(sets)
    out = []
    for each in sets:
        widths = np.zeros(len(found.columns))
        widths[: len(each.widths)] = each.widths
        widths[found.groups[CURVE]] = step.width
        out.append(Rival((*each.groups, CURVE), tuple(widths), each.density, each.left))
    return out


def borne_out(court: Court, found: ArmFit) -> bool:
    """Whether held-out campaigns bear out the waves of joints: they have to lower their rms by LEAST_SHARE."""
    evidence = court.evidence(found.discrepancy)
    less = only(found, [s.group for s in found.taken.steps if s.group != CURVE])
    with_them, without = (rms(evidence.predict(each.widths)[1]) for each in (found.taken, less))
    return with_them <= (1.0 - LEAST_SHARE) * without


# -- shrinkage --------------------------------------------------------------------------------------------------------


def shrinkage(court: Court, found: ArmFit, names: Sequence[str], bench: ArmBench) -> UnseenShrinkage | None:
    """How far campaigns shrink by groups that were chosen and fitted without them; None where no campaign is unseen."""
    if not court.whole:
        return None
    order = [s.group for s in found.taken.steps]
    stages: list[list[Floats]] = []  # per fold: squares (n,) after 0, 1, ... groups
    evidence = court.evidence(found.discrepancy)
    for fold in court.folds:
        taken = _without(court, fold, found)
        order += [s.group for s in taken.steps if s.group not in order]
        stages.append([])
        for count in range(len(order) + 1):
            widths = found.signed(evidence, only(replace(found, taken=taken), order[:count]).widths, fold.others)
            left = evidence.left(fold, evidence.posterior(widths, fold.others))
            stages[-1].append((left**2).sum(axis=1))
    stages = [[*each, *each[-1:] * (len(order) + 1 - len(each))] for each in stages]
    size = [float(np.sqrt(np.mean([s[i].mean() for s in stages]))) for i in range(len(order) + 1)]
    ratio = 1.0 - size[-1] / size[0] if size[0] > 0.0 else 0.0
    covered_share, covered_rms = _where_covered(court, found, bench, [s[-1] for s in stages])
    low, high = _interval([s[0] for s in stages], [s[-1] for s in stages], [p.features for p in court.poses])
    return UnseenShrinkage(
        holdout=tuple(names),
        before_rms_um=round(1e3 * size[0], 3),
        after_rms_um=round(1e3 * size[-1], 3),
        ratio=round(ratio, 4),
        ci95=(round(min(low, ratio), 4), round(max(high, ratio), 4)),
        steps=tuple(
            ShrinkageStep(effect=found.effect(g), target=found.target(g), after_rms_um=round(1e3 * s, 3))
            for g, s in zip(order, size[1:], strict=True)
        ),
        refitted=("frame of the instrument", "place of its target"),
        covered_share=covered_share,
        covered_rms_um=covered_rms,
    )


def _where_covered(
    court: Court, found: ArmFit, bench: ArmBench, after: Sequence[Floats]
) -> tuple[float | None, float | None]:
    """Share of unseen poses whose joints with a curve stand where it was seen, and what is left there, um."""
    joints = curved_joints(bench, found)
    if not joints:
        return None, None
    squares, count = [], 0
    for fold, poses, left in zip(court.folds, court.poses, after, strict=True):
        q = np.concatenate([bench.campaigns[i].q for i in fold.others])
        inside = covered({a: seen_angles(q[:, a]) for a in joints}, poses.q)
        squares.append(left[inside])
        count += len(left)
    every = np.concatenate(squares)
    rest = round(1e3 * float(np.sqrt(every.mean())), 3) if len(every) else None
    return round(len(every) / count, 4), rest


def _without(court: Court, fold: Fold, found: ArmFit) -> Taken:
    """Groups chosen by the other blocks of a fold alone; the same again where these were all that was chosen from."""
    fitted = [court.blocks[i] for i in fold.others]
    if len(fitted) == len(found.linear):
        return found.chosen
    frames = {b.frame: k for k, b in enumerate(fitted)}
    alone = [replace(b, frame=frames[b.frame]) for b in fitted]
    if found.few is not None:
        return found.few.again(alone, fold.others)
    own = parts(alone)
    if found.rough is None:
        return take(Evidence.of(own, found.discrepancy), found.groups)
    groups = {name: columns for name, columns in found.groups.items() if name != CURVE}
    plain = take(Evidence.of(without_waves(own, found.groups), found.rough), groups)
    return curves_taken(Evidence.of(own, found.discrepancy), found.groups, plain)


def _interval(before: Sequence[Floats], after: Sequence[Floats], features: Sequence[Floats]) -> tuple[float, float]:
    """95 % interval of the shrinkage of one more campaign, from squares (n,) of the campaigns at hand.

    Logarithms of the ratio are taken as normal. They vary from campaign to campaign as they do between these, and as means
    over REGIONS_OF_ONE regions of postures do. Student's t, the spread pooled over both.
    """
    each = np.array([log_ratio(float(b.mean()), float(a.mean())) for b, a in zip(before, after, strict=True)])
    square, freedom = scatter(each)
    for b, a, f in zip(before, after, features, strict=True):
        group = regions(f, min(REGIONS, max(len(b) // 8, 2)))
        own = [log_ratio(float(b[group == g].mean()), float(a[group == g].mean())) for g in np.unique(group)]
        inside, regions_seen = scatter(np.array(own))
        square, freedom = square + inside / REGIONS_OF_ONE, freedom + regions_seen
    return of_one_more(float(each.mean()), square, freedom, 1.0 + 1.0 / len(each))
