"""What acts on an arm at a floor: a few causes at single places, an arm that is off everywhere, or something unknown beside them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.arm.curves import with_curves
from camcomp.diagnosis.arm.discrepancy import CLEAR, Discrepancy, fit_discrepancy, without_nuisance
from camcomp.diagnosis.arm.drivers import patterns
from camcomp.diagnosis.arm.few_fit import Suspects, of_few, with_spells
from camcomp.diagnosis.arm.fit import ArmFit, Prepared, fit_of_leftovers, fitted, investigate, named_rows
from camcomp.diagnosis.arm.forward_selection import LEAST_SHARE, rms
from camcomp.diagnosis.arm.gate import Gate, judge, unseen
from camcomp.diagnosis.arm.noise_floor import TipFloor, far_off
from camcomp.diagnosis.arm.placed_effects import Place
from camcomp.diagnosis.arm.poses import CURVE, ArmBench
from camcomp.diagnosis.arm.spells import EFFECT as SPELL
from camcomp.diagnosis.arm.unseen import (
    Court,
    Rival,
    adopted,
    alike,
    beside_curves,
    beside_sways,
    borne_out,
    court,
    court_of_curves,
    holding,
    only,
    rivals,
)
from camcomp.ground.headway import part

MOST, MOST_BESIDE = 6, 3  # causes that are looked for, and beside something unknown
MANY, MANY_WITHOUT_FLOOR = 4, 2  # causes at once that something unknown is weighed against
MOSTLY = 0.65  # of what few causes leave of unseen poses (rms): an arm that is off everywhere is told better
TURNS = 2  # of finding causes beside a discrepancy, and this beside the causes
CLOSE = 1.1  # as large: floors that differ by less need no second look


@dataclass(frozen=True, eq=False)
class ArmCase:
    """A fit with its judges, the sets alike and its gate. chosen, seen_by: the fit as it was chosen, and what judges its shrinkage."""

    found: ArmFit
    judges: Court
    sets: Sequence[Rival]
    gate: Gate
    chosen: ArmFit
    seen_by: Court
    outliers: Sequence[tuple[str, int]] = ()


def solved(
    bench: ArmBench,
    held: ArmBench | None,
    start: Prepared,
    own: Suspects,
    floor: TipFloor | None,
    without: Sequence[str],
) -> ArmCase:
    """What is found at a floor: a few causes, and what lies beyond them where they are not all."""
    noise = floor.sd if floor else fit_of_leftovers(start.linear).noise
    with part(0.0, 0.5):
        case = few_causes(bench, held, own, floor, Discrepancy(0.0, 1.0, noise), MOST)
        if floor is None and (left := _left_inside(case.found)) > CLOSE * noise:  # the richest model leaves too little
            noise = left
            case = few_causes(bench, held, own, floor, Discrepancy(0.0, 1.0, noise), MOST)
    with part(0.5, 1.0):
        return beyond_few(bench, held, start, own, floor, noise, without, case) if _open(case) else case


def at_floor(bench: ArmBench, held: ArmBench | None, case: ArmCase, floor: TipFloor) -> ArmCase:
    """A case judged by another floor: of an arm that is off everywhere, because that fit does not go by the floor."""
    held, _ = _without_outliers(held, case.found)
    return replace(case, gate=_gate(bench, held, case.found, case.judges, floor))


def _left_inside(found: ArmFit) -> float:
    """Deviation, mm per coordinate, of what a fit leaves of the poses that it was fitted to."""
    every = np.concatenate(found.rest)
    free = every.size - np.count_nonzero(found.amount) - sum(b.N.shape[2] for b in found.linear)
    return float(np.sqrt((every**2).sum() / max(free, 1)))


def few_causes(
    bench: ArmBench, held: ArmBench | None, own: Suspects, floor: TipFloor | None, discrepancy: Discrepancy, most: int,
    among: Collection[Place] | None = None,
) -> ArmCase:  # fmt: skip
    """A few causes at single places, beside nothing but the noise of a discrepancy, or beside all of it."""
    found = of_few(bench, own, floor.sd if floor else discrepancy.noise, discrepancy, most, among)
    held, outliers = _without_outliers(held, found)
    judges = court(bench, found, held)
    gate = _gate(bench, held, found, judges, floor)
    return ArmCase(found, judges, alike(judges, found), gate, found, judges, outliers)


def _open(case: ArmCase) -> bool:
    """Whether something else may be at work than the few causes of a case: they leave too much, or are many."""
    many = MANY if case.gate.floor else MANY_WITHOUT_FLOOR
    return case.gate.word == "above" or len(case.found.taken.steps) >= many


def many_causes(
    bench: ArmBench, held: ArmBench | None, start: Prepared, floor: TipFloor | None, without: Sequence[str]
) -> ArmCase:
    """Effects at all joints, as far as campaigns or regions that were not fitted bear them out."""
    with part(0.0, 0.5):
        found = investigate(bench, start)
    held, outliers = _without_outliers(held, found)
    with part(0.5, 0.9):
        curved = found if CURVE in without else with_curves(bench, found)
    judges = court(bench, found, held)
    curve_judges = seen_by = court_of_curves(judges, bench, curved, held)
    chosen = curved
    floor_mm = None if floor is None else 1e-3 * floor.um
    sets = rivals(judges, found, floor_mm)
    kept = holding(judges, found) if held is not None else found.taken
    if judges.whole and kept is found.taken and (best := max(sets, key=lambda s: s.density)) is not sets[0]:
        kept = adopted(found, best)
    if [s.group for s in kept.steps] != [s.group for s in found.taken.steps]:
        before = found.chosen if held is not None else kept
        found = replace(
            fitted(bench, found.columns, found.groups, found.linear, found.discrepancy, kept), chosen=before
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
    return ArmCase(found, judges, sets, _gate(bench, held, found, judges, floor), chosen, seen_by, outliers)


def beyond_few(
    bench: ArmBench, held: ArmBench | None, start: Prepared, own: Suspects, floor: TipFloor | None, noise: float,
    without: Sequence[str], first: ArmCase,
) -> ArmCase:  # fmt: skip
    """What holds where a few lasting causes and the floor are not all.

    A joint that was shifted for a while, an arm that is off everywhere, or else few causes and something unknown, which is
    a discrepancy beside them.
    """
    if SPELL not in without:
        own = with_spells(bench, own, first.found)
        first = few_causes(bench, held, own, floor, Discrepancy(0.0, 1.0, noise), MOST)
        if not _open(first):
            return first
    case, discrepancy = max(
        (_beside(bench, held, own, floor, timed) for timed in (False, True)), key=lambda each: _evidence(each[0])
    )
    if first.gate.word != "above" and _evidence(first) > _evidence(case) - CLEAR:
        return first
    while len(some := _lowering(case)) < len(case.found.taken.steps):
        case = few_causes(bench, held, own, floor, discrepancy, MOST_BESIDE, some)
    many = many_causes(bench, held, start, floor, without)
    return many if _left(many) < MOSTLY * _left(case) else case


def _beside(
    bench: ArmBench, held: ArmBench | None, own: Suspects, floor: TipFloor | None, timed: bool
) -> tuple[ArmCase, Discrepancy]:
    """Few causes beside a discrepancy that goes with the posture, or with time, and that discrepancy."""
    left = [without_nuisance(b.r, b.N) for b in own.linear]
    for _ in range(TURNS):
        discrepancy = replace(fit_discrepancy([b.about(timed) for b in own.linear], left), timed=timed)
        case = few_causes(bench, held, own, floor, discrepancy, MOST_BESIDE)
        left = [without_nuisance(b.r - b.X @ case.found.amount, b.N) for b in case.found.linear]
    return case, discrepancy


def _evidence(case: ArmCase) -> float:
    """Log evidence of few causes."""
    return -np.inf if case.found.few is None else case.found.few.evidence


def _left(case: ArmCase) -> float:
    """Root mean square of unseen poses, mm."""
    evidence = case.judges.evidence(case.found.discrepancy)
    return rms(evidence.predict(case.found.taken.widths)[1])


def _lowering(case: ArmCase) -> list[Place]:
    """Places of a case that lower the rms of unseen poses beside those in front of them."""
    evidence, found = case.judges.evidence(case.found.discrepancy), case.found
    names = [s.group for s in found.taken.steps]
    out, last = [], rms(evidence.predict(np.zeros(evidence.effects))[1])
    for k, name in enumerate(names):
        left = rms(evidence.predict(only(found, names[: k + 1]).widths)[1])
        if left <= (1.0 - LEAST_SHARE) * last:
            out.append((found.effect(name), found.target(name)))
        last = left
    return out


def _without_outliers(held: ArmBench | None, found: ArmFit) -> tuple[ArmBench | None, list[tuple[str, int]]]:
    """Campaigns that are held out without poses far off, with the causes in, and the runs and rows of these."""
    if held is None:
        return None, []
    campaigns, outliers = list(held.campaigns), []
    for k, each in enumerate(campaigns):
        far = far_off(np.linalg.norm(held.gap(k, found.causes()), axis=1), each.time)
        outliers += named_rows(each, far)
        campaigns[k] = each.take(~far)
    return ArmBench(held.robot, held.causes, campaigns), outliers


def _gate(bench: ArmBench, held: ArmBench | None, found: ArmFit, judges: Court, floor: TipFloor | None) -> Gate:
    """What is left on unseen poses against the floor, or where there is none, against what depends on nothing."""
    sd = floor.sd if floor else max(float(np.sqrt(np.mean(np.concatenate(found.rest) ** 2))), 1e-9)
    if found.few is None:
        widths = np.where(found.amount != 0.0, found.taken.widths, 0.0)
    else:
        judges = beside_sways(judges, sd)
        widths = np.ones(judges.blocks[0].X.shape[2])
        widths[: len(found.amount)] = np.where(found.amount != 0.0, found.taken.widths, found.few.small)
    evidence = judges.evidence(Discrepancy(0.0, 1.0, sd))
    left = unseen(evidence, widths, sd, len(found.amount))
    may_be = patterns(held or bench, judges.poses)
    judged = [evidence.blocks[fold.block] for fold in evidence.folds]
    frames = [(b.frame, b.N) for b in judged]
    return judge(left, floor, [p.features for p in judges.poses], [p.time for p in judges.poses], may_be, frames)
