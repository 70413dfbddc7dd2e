"""Why an arm's measured poses differ from its model: static poses as groups of the model of every log.

Steps: poses that are no measurement are left out; the floor is measured or stated; effects are linearised at the nominal
arm and explained, then at what was found; a joint that was shifted for a while is a candidate where something is
unmodelled; withheld campaigns check the result.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from camcomp.diagnosis.arm import answer
from camcomp.diagnosis.arm.case import PoseCase, named_rows
from camcomp.diagnosis.arm.linear import Shelf, linearise
from camcomp.diagnosis.arm.next_poses import next_poses
from camcomp.diagnosis.arm.noise_floor import TipFloor, far_off, resolution, tip_floor
from camcomp.diagnosis.arm.pose_values import of_poses
from camcomp.diagnosis.arm.poses import LEAST_POSES, ArmBench, Poses, combined
from camcomp.diagnosis.arm.temporary_offsets import EFFECT as SPELL
from camcomp.diagnosis.arm.temporary_offsets import temporary_offsets
from camcomp.diagnosis.arm.unseen import check_held_out, notes_of_frames, shrinkage, unseen_poses, without_far_judged
from camcomp.diagnosis.model.candidates import PlacedCause
from camcomp.diagnosis.model.discrepancy import residuals
from camcomp.diagnosis.model.evidence import Background
from camcomp.diagnosis.model.explain import STATED, Explanation, KnownNoise, explain
from camcomp.diagnosis.model.noise import StatedDeviation, rounding_noise
from camcomp.diagnosis.result.floor_rule import within_floor
from camcomp.diagnosis.result.types import UNKNOWN, DiagnosisResult, Floor, GapSize, Outlier
from camcomp.diagnosis.statistics.probability import EVEN, SEED, SURELY
from camcomp.ground import progress
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause
from camcomp.model.statics.description import Robot
from camcomp.model.statics.masses import has_moved_mass

MOST_POSES = 1200  # of a campaign; more are drawn from
PASSES = 4  # of a robust fit
MANY = 4  # causes from which on a joint that was shifted for a while is looked for
LOOSE_FRAME = 1e-3  # ratio of singular values of a frame's columns below which rows do not fix it


def solve(
    *,
    robot: Robot,
    causes: Sequence[Cause],
    runs: Sequence[Poses],
    holdout: Sequence[str],
    without: Sequence[str],
    stated: StatedDeviation,
    origin: Floats,
) -> PoseCase:
    """Explain the campaigns of runs; those of `holdout` are judged and never fitted.

    Raises ValueError when every run is held out, or a campaign has too few poses for its frames.
    """
    own, held, loose = campaigns_of(robot, runs, holdout)
    if not own:
        raise ValueError("every run is held out")
    every = [drawn(each) for each in (*own, *held)]
    bench = ArmBench(robot=robot, causes=tuple(causes), campaigns=every, fitted=len(own), origin=origin)
    bench, shelf, outliers, rest = cleaned(bench, without)
    weights = [huber(each) for each in rest]
    gaps = [bench.gap(k, ()) for k in range(len(bench.campaigns))]
    least = tip_floor(robot, bench.campaigns, gaps, stated, least=True)
    sd = least.sd if least else noise_of_richest(shelf, rest[: len(own)], weights)
    with progress.part(0.1, 0.5):
        shelf, found = explained(bench=bench, shelf=shelf, sd=sd, floor=least, weights=weights, without=without)
    floor = least
    if least is not None:
        floor, again = settled_floor(bench=bench, shelf=shelf, found=found, gaps=gaps, stated=stated, least=least)
        if again:
            with progress.part(0.5, 0.7):
                second = explained(bench=bench, shelf=shelf, sd=floor.sd, floor=floor, weights=weights, without=without)
            hidden = found.unknown > EVEN and found.background.unknown and second[1].unknown <= EVEN
            floor, (shelf, found) = (least, (shelf, found)) if hidden else (floor, second)
    amount, covariance = found.amplitudes()
    step = max(resolution(each.tip) for each in bench.campaigns)
    coarse = rounding_noise(step) > EVEN * sd  # a fair part of the noise
    notes = (f"positions are rounded to {step:g} mm",) if coarse else ()
    final = floor.sd if floor else sd * found.background.noise
    return PoseCase(
        bench=bench, shelf=shelf, explanation=found, amount=amount, covariance=covariance, floor=floor, sd=final,
        outliers=tuple(outliers), loose=loose, notes=notes, every_gap=gaps,
    )  # fmt: skip


def bench_of(
    robot: Robot, causes: tuple[Cause, ...], runs: Sequence[Poses], holdout: Sequence[str], origin: Floats
) -> ArmBench:
    """All poses of the campaigns that are fitted and judged, with the frames that they are judged in."""
    own, held, _ = campaigns_of(robot, runs, holdout)
    return ArmBench(robot=robot, causes=causes, campaigns=[*own, *held], fitted=len(own), origin=origin)


def cleaned(bench: ArmBench, without: Sequence[str]) -> tuple[ArmBench, Shelf, list[tuple[str, int]], list[Floats]]:
    """Bench without poses that are outliers of the richest model, and the residuals (n, 3) mm that this model leaves."""
    campaigns = list(bench.campaigns)
    shelf = Shelf.of(bench.columns(without))
    outliers: list[tuple[str, int]] = []
    left = []
    for k, rest in enumerate(residuals_of_richest(bench, shelf)):
        poses = campaigns[k]
        far = far_off(np.linalg.norm(rest, axis=1), poses.time)
        outliers += named_rows(poses, far)
        campaigns[k] = poses.take(~far)
        left.append(rest[~far])
    return bench.having(campaigns, bench.fitted), shelf, outliers, left


def huber(left: Floats) -> Floats:
    """Factors (n,) >= 1 on the noise of rows with residuals (n, 3).

    Huber, Ann. Math. Stat. 35 (1964) 73; the scale is that of the median.
    """
    square = np.sum(left**2, axis=1)
    scale = max(float(np.median(square)) / chi2.median(3), 1e-18)
    return np.asarray(np.maximum(np.sqrt(square / scale / chi2.ppf(SURELY, 3)), 1.0))


def residuals_of_richest(bench: ArmBench, shelf: Shelf) -> list[Floats]:
    """Residuals (n, 3) mm of every campaign after a robust ridge fit of all single effects at once, at their usual sizes.

    A pose far off bends a model of many columns to itself: rows count less by their residuals in PASSES fits.
    """
    plain = shelf.without_shapes()
    model = linearise(bench.having(bench.campaigns), plain, 1.0)
    left, groups = [g.y for g in model.groups], model.groups
    slab = {int(j): 1.0 for j in np.flatnonzero(model.size > 0.0)}
    for _ in range(PASSES):
        size = max(float(np.median(np.abs(np.concatenate(left)))), 1e-9)
        at = model.posterior(Background(noise=size), slab)
        left = [g.y - model.layout.design(g) @ at.mean for g in groups]
        model = replace(
            model, groups=tuple(replace(g, sd=g.sd * huber(r)[:, None]) for g, r in zip(groups, left, strict=True))
        )
    return left


def noise_of_richest(shelf: Shelf, left: Sequence[Floats], weights: Sequence[Floats]) -> float:
    """Noise, mm per coordinate, for an experiment that states none: the residual (n, 3) of the richest model, over the weights
    (n,) of poses, per degree of freedom.
    """
    values = sum(r.size for r in left)
    used = len(shelf.without_shapes().columns) + 9 * len(left)
    square = sum(float(((r / w[:, None]) ** 2).sum()) for r, w in zip(left, weights, strict=False))
    return max(float(np.sqrt(square / max(values - used, values // 4))), 1e-6)


def explained(
    bench: ArmBench, shelf: Shelf, sd: float, floor: TipFloor | None, weights: Sequence[Floats], without: Sequence[str]
) -> tuple[Shelf, Explanation]:
    """The explanation at a noise sd (mm), linearised at its own result; with temporary offsets where few lasting causes
    do not suffice.
    """
    noise = KnownNoise(floor.freedom) if floor else None
    found = relinearised(bench, shelf, sd, noise, weights)
    doubtful = found.unknown > 1.0 - EVEN or len(found.members) >= MANY
    if SPELL in without or not (doubtful or noise is None):
        return shelf, found
    more = with_temporary_offsets(bench, shelf, found)
    if len(more.columns) == len(shelf.columns):
        return shelf, found
    again = relinearised(bench, more, sd, noise, weights)
    return (more, again) if again.log_evidence > found.log_evidence else (shelf, found)


def relinearised(
    bench: ArmBench, shelf: Shelf, sd: float, noise: KnownNoise | None, weights: Sequence[Floats]
) -> Explanation:
    """Explain at the nominal arm, then at the fitted arm.

    A column that is zero at the nominal arm acts through another one, such as weight on rigid joints, and is excluded.
    """
    nominal = linearise(bench, shelf, sd, None, weights)
    found = explain(nominal, noise)
    at = found.amplitudes()[0]
    if at.any():
        model = linearise(bench, shelf, sd, at, weights).with_columns(nominal.size > 0.0)
        found = explain(model, noise, found.background)
    return found


def with_temporary_offsets(bench: ArmBench, shelf: Shelf, found: Explanation) -> Shelf:
    """The candidates plus the likeliest temporary offset per joint and campaign, in the residuals of the empty set and
    of the fitted set.
    """
    model = found.model
    joints = [bench.joint_motion(c, (), bench.start[k]) for k, c in enumerate(bench.campaigns)]
    frames = [g.N for g in model.groups]
    out = shelf
    for members in dict.fromkeys(((), found.members)):
        rest = [r * model.groups[k].sd for k, r in enumerate(residuals(model, Background(), members))]
        offsets = temporary_offsets(bench, rest, frames, joints)
        new = [(column, ways) for column, ways in offsets if column not in out.columns]
        own = [PlacedCause(SPELL, c.target, (k,), ways) for k, (c, ways) in enumerate(new, len(out.columns))]
        out = out.with_more([column for column, _ in new], own)
    return out


def settled_floor(
    bench: ArmBench, shelf: Shelf, found: Explanation, gaps: Sequence[Floats], stated: StatedDeviation, least: TipFloor
) -> tuple[TipFloor, bool]:
    """The smaller of the floors that repeats show with and without the fitted causes, and whether it clearly exceeds
    the least floor.
    """
    amount = found.amplitudes()[0]
    acting = combined(shelf.columns, {int(j): float(amount[j]) for j in np.flatnonzero(amount)})
    beside = [bench.gap(k, acting) for k in range(len(bench.campaigns))]
    both = [tip_floor(bench.robot, bench.campaigns, each, stated) for each in (gaps, beside)]
    shown = min((one for one in both if one), key=lambda one: one.sd, default=least)
    return shown, bool(shown.sd > np.exp(STATED) * least.sd)


# -- campaigns ----------------------------------------------------------------------------------------------------------


def campaigns_of(
    robot: Robot, runs: Sequence[Poses], holdout: Sequence[str]
) -> tuple[list[Poses], list[Poses], tuple[str, ...]]:
    """Campaigns that are fitted, withheld ones that can be judged, and names of runs that cannot: their rows do not fix a frame
    of their own.
    """
    own = merged([r for r in runs if str(r.run[0]) not in holdout])
    labels, withheld = {each.label for each in own}, [r for r in runs if str(r.run[0]) in holdout]
    held, loose = [], []
    for label in dict.fromkeys(r.label for r in withheld):
        some = [r for r in withheld if r.label == label]
        whole = merged(some, least=1)
        if label in labels or fixes_frame(robot, whole[0]):
            held += whole
        else:
            loose += [str(r.run[0]) for r in some]
    return own, held, tuple(loose)


def fixes_frame(robot: Robot, poses: Poses) -> bool:
    """Whether the rows of a campaign fix the frame of its instrument and the place of its target."""
    if len(poses.q) < LEAST_POSES:
        return False
    bench = ArmBench(robot=robot, causes=(), campaigns=[poses])
    N = bench.groups([], 1.0)[0].N.reshape(-1, 9)
    size = np.linalg.svd(N / np.linalg.norm(N, axis=0), compute_uv=False)
    return bool(size[-1] > LOOSE_FRAME * size[0])


def merged(runs: Sequence[Poses], least: int = LEAST_POSES) -> list[Poses]:
    """One entry per campaign, its poses and the campaigns in an order of their own, and no row twice."""
    labels = dict.fromkeys(r.label for r in runs)
    out = [Poses.together([r for r in runs if r.label == label]) for label in labels]
    for each in out:
        if len(each.q) < least:
            raise ValueError(f"campaign '{each.label}' has {len(each.q)} poses; its frames alone need more")
    return sorted(out, key=lambda each: tuple(each.q[0]))


def drawn(poses: Poses) -> Poses:
    """At most MOST_POSES poses, drawn evenly."""
    if len(poses.q) <= MOST_POSES:
        return poses
    rng = np.random.default_rng(SEED)
    return poses.take(np.sort(rng.choice(len(poses.q), MOST_POSES, replace=False)))


# -- result -------------------------------------------------------------------------------------------------------------


def studied(
    robot: Robot,
    causes: Sequence[Cause],
    runs: Sequence[Poses],
    *,
    holdout: Sequence[str] = (),
    without: Sequence[str] = (),
    stated: StatedDeviation | None = None,
    origin: Floats | None = None,
) -> tuple[DiagnosisResult, tuple[str, ...]]:
    """Result for static poses of an arm, and notes for the reader of the logs.

    runs: one entry per run, whose label is its campaign (clamping). holdout: names of runs (`Poses.run`) that are judged and
    never fitted. origin (3,): of the program, machine frame, mm. Raises ValueError when a campaign has too few poses for its frames.
    """
    with progress.part(0.0, 0.7):
        case = solve(
            robot=robot, causes=causes, runs=runs, holdout=holdout, without=without,
            stated=StatedDeviation() if stated is None else stated, origin=np.zeros(3) if origin is None else origin,
        )  # fmt: skip
    bench = case.bench
    case = without_far_judged(case)
    unseen = unseen_poses(case)
    case = replace(case, check=check_held_out(case, unseen[0]))
    progress.done(0.8)
    named, minor = answer.causes(case)
    word = answer.verdict(case, named)
    named = answer.with_unknown(case, named, word)
    progress.done(0.9)
    names = [
        n for n in dict.fromkeys(str(r.run[0]) for r in runs) if (n in holdout or not holdout) and n not in case.loose
    ]
    known = any(c.effect != UNKNOWN for c in named)
    alternatives = answer.alternatives(case, named) if word == "ambiguous" or (word == "unknown" and known) else ()
    floor, size = case.floor, 1e3 * np.linalg.norm(np.concatenate(list(case.gaps)), axis=1)
    result = DiagnosisResult(
        verdict=word, gap=GapSize.of(size, None if floor is None else floor.um), where=answer.where(case, word), causes=named,
        alternatives=alternatives if word == "ambiguous" or len(alternatives) > 1 else (),
        shrinkage=shrinkage(case, unseen, named, sorted(names), bool(holdout)), minor=minor,
        next_experiment=next_poses(case, word),
        floor=Floor(um=round(floor.um, 3), source=floor.source) if floor else Floor(um=None, source="not identifiable"),
        outliers=tuple(Outlier(run=run, row=row) for run, row in sorted(set(case.outliers))),
        standards=of_poses(robot, bench.campaigns, case.every_gap),
    )  # fmt: skip
    return within_floor(result), (
        *case.notes,
        *notes_of_weight(robot, bench.campaigns, without),
        *notes_of_frames(case, named),
    )


def notes_of_weight(robot: Robot, campaigns: Sequence[Poses], without: Sequence[str]) -> tuple[str, ...]:
    """Effects under weight that have no columns, because neither masses nor torques are known."""
    if has_moved_mass(robot) or any(each.torque is not None for each in campaigns):
        return ()
    names = [name for name in ("gravity_compliance", "base_compliance") if name not in without]
    if not names:
        return ()
    text = f"no mass_kg in the machine file and no torques in the logs: {' and '.join(names)} cannot be found"
    return (text,)
