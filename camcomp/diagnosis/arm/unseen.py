"""What is judged on poses that took no part in choosing: sets of groups and their rivals, and how far the gap shrinks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.stats import t as student

from camcomp.diagnosis.arm.discrepancy import (
    Discrepancy,
    Evidence,
    Fold,
    ResidualBlock,
    each_withheld,
    regions,
    without_nuisance,
)
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
from camcomp.diagnosis.arm.poses import ArmBench, Poses
from camcomp.diagnosis.result.types import ShrinkageStep, UnseenShrinkage
from camcomp.ground.datatypes import Floats

# Sets of one campaign that leave up to this many times as much: effects that differ by 6 % of the rms within a campaign
# of the UR10 differ by a factor of two on the next one.
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
    widths = np.zeros(len(found.columns))
    for step in steps:
        widths[found.groups[step.group]] = step.width
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
        near = 1.0 + LEAST_SHARE if floor_mm is not None and least < 1.25 * floor_mm else ALIKE_INSIDE
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


# -- shrinkage --------------------------------------------------------------------------------------------------------


def shrinkage(court: Court, found: ArmFit, names: Sequence[str]) -> UnseenShrinkage | None:
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
    low, high = _interval([s[0] for s in stages], [s[-1] for s in stages], [p.features for p in court.poses])
    return UnseenShrinkage(
        holdout=tuple(names),
        before_rms_um=round(1e3 * size[0], 3),
        after_rms_um=round(1e3 * size[-1], 3),
        ratio=round(ratio, 4),
        ci95=(round(min(low, ratio), 4), round(max(high, ratio), 4)),
        steps=tuple(
            ShrinkageStep(effect=g, target=None, after_rms_um=round(1e3 * s, 3))
            for g, s in zip(order, size[1:], strict=True)
        ),
        refitted=("frame of the instrument", "place of its target"),
    )


def _without(court: Court, fold: Fold, found: ArmFit) -> Taken:
    """Groups chosen by the other blocks of a fold alone; the same again where these were all that was chosen from."""
    fitted = [court.blocks[i] for i in fold.others]
    if len(fitted) == len(found.linear):
        return found.chosen
    frames = {b.frame: k for k, b in enumerate(fitted)}
    own = [replace(b, frame=frames[b.frame]) for b in fitted]
    return take(Evidence.of(parts(own), found.discrepancy), found.groups)


def _interval(before: Sequence[Floats], after: Sequence[Floats], features: Sequence[Floats]) -> tuple[float, float]:
    """95 % interval of the shrinkage of one more campaign, from squares (n,) of the campaigns at hand.

    Logarithms of the ratio are taken as normal. They vary from campaign to campaign as they do between these, and as means
    over REGIONS_OF_ONE regions of postures do. Student's t, the spread pooled over both.
    """
    per_campaign, square, freedom = [], 0.0, 0
    for b, a, f in zip(before, after, features, strict=True):
        per_campaign.append(_log_ratio(b, a))
        group = regions(f, min(REGIONS, max(len(b) // 8, 2)))
        own = np.array([_log_ratio(b[group == g], a[group == g]) for g in np.unique(group)])
        square += float(((own - own.mean()) ** 2).sum()) / REGIONS_OF_ONE
        freedom += len(own) - 1
    each = np.array(per_campaign)
    square, freedom = square + float(((each - each.mean()) ** 2).sum()), max(freedom + len(each) - 1, 1)
    half = float(student.ppf(0.975, freedom) * np.sqrt(square / freedom * (1.0 + 1.0 / len(each))))
    return 1.0 - float(np.exp(each.mean() + half)), 1.0 - float(np.exp(each.mean() - half))


def _log_ratio(before: Floats, after: Floats) -> float:
    return 0.5 * float(np.log(max(after.mean(), 1e-300) / max(before.mean(), 1e-300)))
