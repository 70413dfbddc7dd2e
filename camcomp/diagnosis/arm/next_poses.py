"""Which poses to measure next: the most informative ones about the causes found, with frames of their own; repeats where
the noise floor is unknown.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.arm.case import PoseCase
from camcomp.diagnosis.arm.noise_floor import REPEATS
from camcomp.diagnosis.arm.poses import ArmBench, Column, Poses
from camcomp.diagnosis.model.design import bits, designed
from camcomp.diagnosis.model.evidence import FREE
from camcomp.diagnosis.result.types import UNKNOWN, NextExperiment, PosesToMeasure
from camcomp.diagnosis.statistics.probability import SEED
from camcomp.ground.datatypes import Floats

POSES = 40  # of a proposal: an hour with a tracker
CANDIDATES = 400  # postures that are looked at


def next_poses(case: PoseCase, word: str) -> NextExperiment | None:
    """The most informative poses, as a campaign of their own; repeats where the floor is unknown."""
    if word in ("none", "identified"):
        return None
    several = len(case.bench.campaigns) > 1
    effects = [*dict.fromkeys(p.effect for p in case.parts), UNKNOWN]
    if case.floor is None and several:
        return NextExperiment(
            action=f"visit {REPEATS} of the poses once more, other poses in between, so that the floor is known",
            separates=tuple(effects), gain=1.0, poses=_listed(case.bench, _repeats(case.bench.campaigns[0])),
            outcomes=(
                "If visits of one pose differ by as much as the causes leave, nothing is left to explain.",
                "If they differ by less, something unknown is at work.",
            ),
        )  # fmt: skip
    on = [int(j) for j in np.flatnonzero(case.amount)]
    columns = [case.shelf.columns[j] for j in on]
    q, gain = proposed(case.bench, columns, case.covariance[np.ix_(on, on)], max(case.sd, 1e-6))
    poses = _listed(case.bench, q) if len(q) else None
    if not several and columns:
        return _second_campaign(case, poses, gain)
    if poses is None:
        return None
    return NextExperiment(
        action=f"measure {len(q)} more poses with a clamping of their own; try them slowly first: collisions are not checked",
        separates=tuple(effects), gain=round(gain, 4), poses=poses,
        outcomes=(
            ("If the causes found leave no more on these poses than on the others, they hold there as well and their "
            "intervals become narrower."),
            ("If they leave more, and the curves of the joints explain it once these poses are fitted, the first poses "
            "lacked those angles."),
            "If they leave as much after that, what is unknown does not go by the angle of one joint.",
        ),
    )  # fmt: skip


def _second_campaign(case: PoseCase, poses: PosesToMeasure | None, gain: float) -> NextExperiment:
    """Other postures, where there is one campaign only: within it, effects stand in for each other."""
    sets = [case.places(m) for m in case.alternatives()]
    names = ["; ".join(e if t is None else f"{e} {t}" for e, t in each) for each in sets if each]
    return NextExperiment(
        action="measure a second campaign in other postures, with a clamping of its own",
        separates=tuple(dict.fromkeys(effect for each in sets for effect, _ in each)), gain=round(gain, 4), poses=poses,
        outcomes=(
            *(f"If {one} alone predict the new poses, they are the cause." for one in names[:2]),
            "If no set predicts them, the cause is not in the library.",
        ),
    )  # fmt: skip


def _repeats(campaign: Poses) -> Floats:
    """Joints (REPEATS, m) of every other quantile of the poses, in an order that does not stay in one place."""
    some = np.unique(np.linspace(0, len(campaign.q) - 1, REPEATS).astype(int))
    return np.asarray(campaign.q[some[np.random.default_rng(SEED).permutation(len(some))]], float)


def candidates(bench: ArmBench, count: int = CANDIDATES) -> Floats:
    """Postures (n, m) inside the limits of the joints whose platform stands in the box that measured ones span.

    Fewer where few of the drawn postures stand there; the seed is fixed. Collisions are not checked.
    """
    rng = np.random.default_rng(SEED)
    seen = np.concatenate([each.q for each in bench.campaigns])
    points = np.concatenate([_places(bench, each.q) for each in bench.campaigns])
    low, high = np.array([a.limits for a in bench.robot.actuators], float).T
    turns = np.array([a.revolute for a in bench.robot.actuators])
    low, high = np.where(turns, np.maximum(low, -np.pi), low), np.where(turns, np.minimum(high, np.pi), high)
    known = np.isfinite(low) & np.isfinite(high) & (low < high)
    low, high = np.where(known, low, seen.min(axis=0)), np.where(known, high, seen.max(axis=0))
    q = low + (high - low) * rng.random((20 * count, len(low)))
    place = _places(bench, q)
    inside = np.flatnonzero(((place >= points.min(axis=0)) & (place <= points.max(axis=0))).all(axis=1))
    return np.asarray(q[inside[:count]], float)


def proposed(bench: ArmBench, columns: Sequence[Column], covariance: Floats, noise: float) -> tuple[Floats, float]:
    """Joints (POSES, m) to measure in a new campaign, and their expected information on the effects, bits.

    columns with their covariance (k, k): the effects to determine. Empty without columns, or where candidate poses are
    missing.
    """
    q = candidates(bench) if columns else np.zeros((0, len(bench.actuators)))
    if not len(q):
        return q, 0.0
    poses = _as_poses(q)
    stood = bench.standing(poses, ()).hung
    poses = replace(poses, tip=bench.start[0].tips(stood.point, stood.rotation))
    there = bench.having([poses])
    group = there.groups(columns, noise)[0]
    k = len(columns)
    whole = np.diag(np.concatenate([np.ones(k), np.full(9, 1.0 / FREE)]))
    whole[:k, :k] = covariance + 1e-12 * np.eye(k)
    design = designed(np.concatenate([group.A, group.N], axis=2) / noise, whole, POSES)
    return q[list(design.chosen)], bits(whole[:k, :k]) - bits(design.covariance[:k, :k])


def _places(bench: ArmBench, q: Floats) -> Floats:
    """Platform points (n, 3) of joints q (n, m)."""
    return np.asarray(bench.standing(_as_poses(q), ()).hung.point, float)


def _as_poses(q: Floats) -> Poses:
    n = len(q)
    return Poses(
        label="next", q=q, tip=np.zeros((n, 3)), time=np.arange(float(n)), temperature=None, run=np.full(n, "next")
    )


def _listed(bench: ArmBench, q: Floats) -> PosesToMeasure:
    return PosesToMeasure(
        joints=bench.actuators,
        positions=tuple(tuple(round(float(v), 6) for v in row) for row in q),
        platform_mm=tuple(
            (round(float(x), 3), round(float(y), 3), round(float(z), 3)) for x, y, z in _places(bench, q)
        ),
    )


def pose_list(poses: PosesToMeasure, revolute: tuple[bool, ...], target: str) -> str:
    """Text of the list: JSON for a file called .json (`joint_names`, `points`: `positions` rad or m), else CSV.

    revolute: of every joint. The CSV has a row per pose: `act_<a>_rad` (`_mm`) as in logs, then the platform's position.
    """
    if target.endswith(".json"):
        si = [[v if turns else 1e-3 * v for v, turns in zip(row, revolute, strict=True)] for row in poses.positions]
        return (
            json.dumps({"joint_names": poses.joints, "points": [{"positions": each} for each in si]}, indent=1) + "\n"
        )
    names = [f"act_{a}_{'rad' if turns else 'mm'}" for a, turns in zip(poses.joints, revolute, strict=True)]
    lines = [",".join([*names, "platform_x_mm", "platform_y_mm", "platform_z_mm"])]
    for joints, place in zip(poses.positions, poses.platform_mm, strict=True):
        lines.append(",".join([*(f"{v:.6f}" for v in joints), *(f"{v:.3f}" for v in place)]))
    return "\n".join(lines) + "\n"
