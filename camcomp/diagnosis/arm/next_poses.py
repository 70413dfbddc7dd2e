"""Which poses to measure next: those that tell most about what is still uncertain, chosen one by one and then exchanged.

What a pose tells is its expected information about the effects of a linearised model, beside a frame of its own that the
new campaign brings along (log det; Fedorov, Theory of Optimal Experiments, 1972).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.arm.curves import covered, seen_angles
from camcomp.diagnosis.arm.poses import CURVE, ArmBench, Column, Poses
from camcomp.ground.datatypes import Floats

POSES = 40  # of a proposal: an hour with a tracker
CANDIDATES = 400  # postures that are looked at
EXCHANGES = 2  # rounds in which every pose may be exchanged for a better one
FRAME = 10.0  # prior deviation of the new campaign's frame and target, in mm, and mm at ARM_MM for its turns
ARM_MM = 1000.0
POSES_SEED = 20201110  # the same answer twice


@dataclass(frozen=True, eq=False)
class Design:
    """Poses chosen, as indices of the candidates in the order of choice, their information (bits), what stays uncertain (k, k)."""

    chosen: tuple[int, ...]
    gain: float
    covariance: Floats


def designed(X: Floats, covariance: Floats, noise: float, count: int) -> Design:
    """`count` of n candidates with rows X (n, 3, k) under a prior covariance (k, k), noise mm per coordinate."""
    belief = _Belief(X, covariance, noise)
    chosen: list[int] = []
    for _ in range(min(count, len(X))):
        chosen.append(belief.take(belief.best(chosen)))
    for _ in range(EXCHANGES):
        for i in range(len(chosen)):
            belief.give_back(chosen[i])
            rest = chosen[:i] + chosen[i + 1 :]
            chosen[i] = belief.take(belief.best(rest))
    return Design(tuple(chosen), _bits(covariance, belief.covariance), belief.covariance)


class _Belief:
    """Posterior covariance of the effects after some poses, updated pose by pose."""

    def __init__(self, X: Floats, covariance: Floats, noise: float) -> None:
        self.X, self.covariance = X, covariance.copy()
        self.square = noise**2 * np.eye(3)
        self.spread = np.einsum("nik,kl,njl->nij", X, covariance, X, optimize=True)  # of every candidate's tip

    def best(self, without: list[int]) -> int:
        """The most informative candidate outside of `without`."""
        value = np.linalg.slogdet(np.eye(3) + self.spread / self.square[0, 0])[1]
        value = np.array(value)
        value[without] = -np.inf
        return int(np.argmax(value))

    def take(self, k: int) -> int:
        """Measures a candidate."""
        self._move(k, np.linalg.inv(self.spread[k] + self.square), -1.0)
        return k

    def give_back(self, k: int) -> None:
        """As if a candidate had not been measured."""
        self._move(k, np.linalg.inv(self.square - self.spread[k]), 1.0)

    def _move(self, k: int, weight: Floats, sign: float) -> None:
        along = self.covariance @ self.X[k].T
        self.covariance += sign * along @ weight @ along.T
        ahead = self.X @ along
        self.spread += sign * ahead @ weight @ np.swapaxes(ahead, 1, 2)


def candidates(bench: ArmBench, count: int = CANDIDATES) -> Floats:
    """Postures (n, m) inside the limits of the joints whose platform stands in the box that measured ones span.

    Fewer where few of the drawn postures stand there; the seed is fixed. Collisions are not checked.
    """
    rng = np.random.default_rng(POSES_SEED)
    drives = bench.robot.actuators
    seen = np.concatenate([each.q for each in bench.campaigns])
    points = np.concatenate([bench.standing(each, ()).hung.point for each in bench.campaigns])
    box = points.min(axis=0), points.max(axis=0)
    ends = []
    for a, drive in enumerate(drives):
        low, high = drive.limits
        if drive.revolute:
            low, high = max(low, -np.pi), min(high, np.pi)
        elif not np.isfinite([low, high]).all():
            low, high = float(seen[:, a].min()), float(seen[:, a].max())
        ends.append((low, high) if low < high else (float(seen[:, a].min()), float(seen[:, a].max())))
    lowest, highest = np.array(ends).T
    q = lowest + (highest - lowest) * rng.random((20 * count, len(drives)))
    point = bench.standing(_as_poses(q), ()).hung.point
    inside = np.flatnonzero(((point >= box[0]) & (point <= box[1])).all(axis=1))
    return np.asarray(q[inside[:count]], float)


def proposed(
    bench: ArmBench, columns: Sequence[Column], covariance: Floats, noise: float
) -> tuple[Floats, Floats, float]:
    """Joints (POSES, m) to measure in a new campaign, their platform points (POSES, 3), and the expected information
    (bits).

    columns with their covariance (k, k): the effects to determine. Empty without columns, or where candidate poses are
    missing.
    """
    q = candidates(bench)
    if not columns or not len(q):
        return np.zeros((0, len(bench.actuators))), np.zeros((0, 3)), 0.0
    poses = _as_poses(q)
    place = bench.standing(poses, ()).hung.point
    poses = replace(poses, tip=bench.start[0].tips(place, bench.standing(poses, ()).hung.rotation))
    there = ArmBench(robot=bench.robot, causes=bench.causes, campaigns=[poses])
    group = there.groups(columns, noise)[0]
    k = len(columns)
    whole = np.zeros((k + 9,) * 2)
    whole[:k, :k] = covariance + 1e-12 * np.eye(k)
    whole[k:, k:] = np.diag([FRAME / ARM_MM] * 3 + [FRAME] * 6) ** 2
    design = designed(np.concatenate([group.A, group.N], axis=2), whole, noise, POSES)
    chosen = list(design.chosen)
    return q[chosen], place[chosen], _bits(whole[:k, :k], design.covariance[:k, :k])


def _bits(before: Floats, after: Floats) -> float:
    """Information gained where a covariance (k, k) becomes another."""
    return 0.5 * float(np.linalg.slogdet(before)[1] - np.linalg.slogdet(after)[1]) / float(np.log(2.0))


def unseen_share(bench: ArmBench, columns: Sequence[Column], q: Floats) -> float:
    """Share of poses q (n, m) in which some joint with a curve stands where no pose was."""
    joints = sorted({bench.actuators.index(str(c.target)) for c in columns if c.effect == CURVE})
    if not joints or not len(q):
        return 0.0
    angles = np.concatenate([bench.campaigns[k].q for k in bench.own])
    return float(1.0 - covered({a: seen_angles(angles[:, a]) for a in joints}, q).mean())


def _as_poses(q: Floats) -> Poses:
    n = len(q)
    return Poses(
        label="next", q=q, tip=np.zeros((n, 3)), time=np.arange(float(n)), temperature=None, run=np.full(n, "next")
    )
