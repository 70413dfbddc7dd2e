"""What the leftover of poses may depend on, and what it does depend on: angles and torques of joints, places of the tip, time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from camcomp.diagnosis.arm.dependence import Dependence, dependences, turns
from camcomp.diagnosis.arm.gate import Gate, discovered, neighbours
from camcomp.diagnosis.arm.poses import ArmBench, Poses
from camcomp.ground.datatypes import Floats

STEADY_K = 0.1  # by which a temperature has to change to drive anything
OF_ITS_OWN = " of its own"  # what moves its joint alone
STEPS = 10  # of a covariate
MOVE_MM, TURN_RAD = 0.3, 3e-4  # of one step: the size that ridges think of


def patterns(bench: ArmBench, campaigns: Sequence[Poses]) -> dict[str, list[Floats]]:
    """What a leftover of poses may depend on: covariate -> per campaign motions (n, 3, p) of the tip."""
    out: dict[str, list[Floats]] = {}
    for campaign in campaigns:
        hung = bench.standing(campaign, ()).hung
        moves = bench.joint_motion(campaign, (), bench.start[0])
        for a, drive in enumerate(bench.robot.actuators):
            own = moves[:, :, a]
            if drive.revolute:
                out.setdefault(f"position:{drive.name}", []).append(turns(own, campaign.q[:, a]))
                torque = hung.drive[:, a] / max(float(np.abs(hung.drive[:, a]).max()), 1e-9)
                pair = np.stack([torque, torque * np.abs(torque)], axis=1)
                out.setdefault(f"force:{drive.name}", []).append(3e-4 * own[:, :, None] * pair[:, None, :])
            else:
                span = np.ptp(campaign.q[:, a]) or 1.0
                out.setdefault(f"position:{drive.name}", []).append(
                    turns(own * 1e3, 2 * np.pi * campaign.q[:, a] / span)
                )
        slow = (campaign.time - campaign.time.mean()) / max(float(np.ptp(campaign.time)), 1e-9)
        wide = np.stack([slow, slow**2], axis=1)
        every = np.concatenate([np.eye(3)[None] * 0.3 * f[:, None, None] for f in wide.T], axis=2)
        out.setdefault("time", []).append(every)
    if all(c.temperature is not None and np.ptp(c.temperature) > STEADY_K for c in campaigns):
        out["temperature"] = [
            np.eye(3)[None] * 0.1 * (c.temperature - c.temperature.mean())[:, None, None]  # type: ignore[union-attr]
            for c in campaigns
        ]
    return out


def drivers(bench: ArmBench, poses: Sequence[Poses], gate: Gate) -> list[Dependence]:
    """Covariates with the shares of the leftover that they foretell, the most first; one in a hundred is false.

    What the gate has looked at, and steps of any height over angles, torques and places. Where nothing of that foretells it, and
    poses share their leftover with those next to them in time or in posture, it is that: the posture of the joint that moves
    the tip most nearly as the leftover goes.
    """
    features, rest = [p.features for p in poses], gate.left.rest
    finer: dict[str, list[Floats]] = {}
    for each in poses:
        for name, motion in _steps_of(bench, each):
            finer.setdefault(name, []).append(motion)
    every = dependences(finer, rest, features)
    found = {d.covariate: d for d in gate.drivers}
    near, soon = neighbours(rest, features), neighbours(rest, [p.time[:, None] for p in poses])
    for d in discovered([*every, near, soon]):
        name = d.covariate.removesuffix(OF_ITS_OWN)
        if name and d.share > found.get(name, Dependence(name, 0.0, 0.0)).share:
            found[name] = Dependence(name, d.share, d.log10_chance)
    for d in discovered([near, soon]) if not found else ():
        joint = max(range(len(bench.actuators)), key=lambda a: _along(bench, poses, rest, a))
        name = "time" if d is soon else f"position:{bench.actuators[joint]}"
        found[name] = Dependence(name, d.share, d.log10_chance)
    return sorted(found.values(), key=lambda d: -d.share)


def _steps_of(bench: ArmBench, poses: Poses) -> Iterator[tuple[str, Floats]]:
    """Covariates and motions (n, 3, p) of the tip that are level between steps: of a joint alone, or of all three axes."""
    hung, moves = bench.standing(poses, ()).hung, bench.joint_motion(poses, (), bench.start[0])
    every = MOVE_MM * np.eye(3)
    for a, drive in enumerate(bench.robot.actuators):
        for kind, values in (("position", poses.q[:, a]), ("force", hung.drive[:, a])):
            steps = _level(values)
            yield f"{kind}:{drive.name}{OF_ITS_OWN}", TURN_RAD * moves[:, :, a][:, :, None] * steps[:, None, :]
            yield f"{kind}:{drive.name}", np.einsum("ij,nk->nijk", every, steps).reshape(len(steps), 3, -1)
    for axis, values in zip("xyz", hung.point.T, strict=True):
        steps = _level(values)
        yield f"position:{axis}", np.einsum("ij,nk->nijk", every, steps).reshape(len(steps), 3, -1)


def _level(values: Floats) -> Floats:
    """Steps (n, STEPS) between equally many of the values (n,), without their means."""
    edges = np.quantile(values, np.linspace(0.0, 1.0, STEPS + 1)[1:-1])
    steps = (np.searchsorted(edges, values)[:, None] == np.arange(STEPS)).astype(float)
    return np.asarray(steps - steps.mean(axis=0))


def _along(bench: ArmBench, poses: Sequence[Poses], rest: Sequence[Floats], a: int) -> float:
    """Share of the leftover's energy that goes along how joint a moves the tip."""
    along = 0.0
    for each, left in zip(poses, rest, strict=True):
        way = bench.joint_motion(each, (), bench.start[0])[:, :, a]
        size = np.maximum((way**2).sum(axis=1), 1e-300)
        along += float(((left * way).sum(axis=1) ** 2 / size).sum())
    return along
