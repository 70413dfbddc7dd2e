"""The fit of few causes at single places: chosen by evidence, then through the model itself."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.arm.discrepancy import Discrepancy, Evidence, ResidualBlock
from camcomp.diagnosis.arm.few_causes import Few, FewCauses, Members, Weighed, search, weighed
from camcomp.diagnosis.arm.fit import ArmFit, Prepared, parts, relinearised
from camcomp.diagnosis.arm.forward_selection import LEAST_GAIN, Step, Taken
from camcomp.diagnosis.arm.placed_effects import Place, PlacedEffect, extended, placed_effects
from camcomp.diagnosis.arm.poses import CURVE, ArmBench, Column, combined
from camcomp.diagnosis.arm.spells import spells
from camcomp.ground import headway
from camcomp.ground.datatypes import Floats

PASSES = 2  # of linearising about what was found


@dataclass(frozen=True, eq=False)
class Suspects:
    """All that few causes are looked for among: columns, candidates, and the campaigns linearised about the nominal arm."""

    columns: tuple[Column, ...]
    suspected: tuple[PlacedEffect, ...]
    linear: tuple[ResidualBlock, ...]
    joints: tuple[Floats, ...]  # per campaign (n, 3, m): motion of the tip by every joint


def suspects(bench: ArmBench, start: Prepared, without: Sequence[str] = ()) -> Suspects:
    """Every effect at every place."""
    waves = [] if CURVE in without else bench.waves()
    more = [*bench.shaped(without), *waves]
    columns = (*start.columns, *more)
    joints = tuple(bench.joint_motion(each, (), bench.registration(k, ())) for k, each in enumerate(bench.campaigns))
    linear = extended(bench, start.linear, joints, more)
    return Suspects(columns, tuple(placed_effects(columns)), tuple(linear), joints)


def with_spells(bench: ArmBench, own: Suspects, found: ArmFit) -> Suspects:
    """With spells in which a joint was shifted, by what is left of the nominal arm, and beside what was found, one after the other."""
    columns, some, linear = list(own.columns), list(own.suspected), list(own.linear)
    frames = [b.N for b in own.linear]
    lefts = [[b.r for b in own.linear]]
    widths = np.zeros(len(found.columns))
    for step in found.taken.steps:  # those that are too many take the spell up
        on = [j for j in found.groups[step.group] if found.taken.widths[j] > 0.0]
        widths[on] = found.taken.widths[on]
        amount, _ = found.evidence.fit(widths)
        lefts.append([b.r - b.X @ amount for b in found.linear])
    for rest in lefts:
        more, there = spells(bench, rest, frames, own.joints, len(columns))
        new = [k for k, column in enumerate(more) if column not in columns]
        if new:
            some += [replace(there[k], columns=(len(columns) + i,)) for i, k in enumerate(new)]
            more = [more[k] for k in new]
            columns += more
            linear = extended(bench, linear, own.joints, more)
    return replace(own, columns=tuple(columns), suspected=tuple(some), linear=tuple(linear))


def of_few(
    bench: ArmBench,
    own: Suspects,
    sd: float,
    discrepancy: Discrepancy,
    most: int,
    among: Collection[Place] | None = None,
) -> ArmFit:
    """The most probable set of up to `most` causes. sd: floor, mm; discrepancy: what rows are off by, the floor included.

    among: places that causes may be at, all where nothing is said.
    """
    columns, some, linear = own.columns, own.suspected, list(own.linear)
    times = [each.time for each in bench.campaigns]
    for turn in range(PASSES):
        with headway.part(turn / PASSES, (turn + 1) / PASSES):
            w = weighed(linear, times, sd, discrepancy, some, columns)
            found = search(w, most, among)
        members = found.sets[0][0]
        amount = np.zeros(len(columns))
        covariance = np.zeros((len(columns), len(columns)))
        if not members:
            break
        on = w.indices(members)
        amount[on], covariance[np.ix_(on, on)], _ = w.best(members)
        linear = relinearised(bench, columns, linear, amount)
    groups: dict[str, list[int]] = {}
    for c in some:
        groups[_label(c)] = sorted({*groups.get(_label(c), ()), *c.columns})
    noise = Discrepancy(0.0, 1.0, sd)
    taken = _taken(w, members, Evidence.of(parts(linear), noise))
    rest = tuple(bench.gap(k, combined(columns, dict(enumerate(amount)))) for k in range(len(linear)))

    def again(blocks: Sequence[ResidualBlock], campaigns: Sequence[int]) -> Taken:
        less = weighed(blocks, [times[k] for k in campaigns], sd, discrepancy, some, columns)
        return _taken(less, search(less, most, among).sets[0][0], Evidence.of(parts(blocks), noise))

    few = Few(found.places, _alike(found, some), w.small, found.evidence, again)
    evidence = Evidence.of(linear, noise)
    return ArmFit(columns, groups, taken, amount, covariance, noise, evidence, tuple(linear), rest, taken, few=few)


def _label(c: PlacedEffect) -> str:
    return c.effect if c.target is None else f"{c.effect} {c.target}"


def _alike(found: FewCauses, some: Sequence[PlacedEffect]) -> tuple[tuple[str, ...], ...]:
    """The best set as names of groups, and those nearly as probable that are not the best and something more."""
    best, most = found.sets[0]
    own = {_label(some[i]) for i in best}
    sets = [({_label(some[i]) for i in members}, p) for members, p in found.sets]
    return tuple(tuple(sorted(each)) for each, p in sets if p >= most * np.exp(-LEAST_GAIN) and not each > own)


def _taken(w: Weighed, members: Members, evidence: Evidence) -> Taken:
    """Members as steps, those first that move the tip most."""
    widths = np.zeros(len(w.columns))
    if members:
        amount, _, width = w.best(members)
        on = w.indices(members)
        widths[on] = width * w.widths(members)
        moved = dict(zip(on, np.abs(amount) * w.size[on], strict=True))
        size = {i: float(np.hypot.reduce([moved[j] for j in w.candidates[i].columns])) for i in members}
        members = tuple(sorted(members, key=lambda i: -size[i]))
    density, squares = evidence.predict(np.zeros(len(widths)))
    none = Step("", 0.0, density, squares)
    steps, so_far = [], np.zeros(len(widths))
    for i in members:
        own = list(w.candidates[i].columns)
        so_far[own] = widths[own]
        density, squares = evidence.predict(so_far)
        steps.append(Step(_label(w.candidates[i]), float(widths[own].max()), density, squares))
    return Taken(none, tuple(steps), (), widths)
