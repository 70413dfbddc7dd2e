"""Campaigns of static poses: where the arm is sent, when, how warm it is, and where a target on it then stands."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tests.validation.poses.arm import HARMONICS, Arm, Off, Stand, turn_x, turn_y, turn_z

WAYS = ("joints", "narrow", "grid", "sphere", "swings")


class AgainError(Exception):
    """The drawn experiment is impossible; draw again."""


@dataclass
class Odd:
    """A fault that no effect describes, of size one: all of it is linear in its size."""

    name: str
    target: str | None
    say: dict
    shift: np.ndarray | float = 0.0  # (n, a) of the joints
    geometry: np.ndarray | float = 0.0  # (n, a, 5)
    base: np.ndarray | None = None  # (n, 3) rotation vectors
    seat: np.ndarray | float = 0.0  # (n, 3) of the target, in the platform
    seen: np.ndarray | float = 0.0  # (n, 3) in the machine frame
    since: float | None = None  # common time at which it begins
    size: float = 1.0


@dataclass
class Run:
    """One file of poses."""

    name: str
    clamping: int
    started_s: float
    way: str
    visits: int  # of most poses
    q: np.ndarray
    t: np.ndarray


@dataclass
class Plant:
    """All runs of one experiment, rows one under the other."""

    arm: Arm
    runs: list[Run]
    seats: np.ndarray  # (clampings, 3) target in the platform's frame
    trackers: list[tuple[np.ndarray, np.ndarray]]  # turn (3, 3), place (3,) in the machine frame
    warmth: tuple[float, float, float, float]  # rise K, seconds, swing K, period s
    q: np.ndarray = field(init=False)
    run: np.ndarray = field(init=False)
    clamping: np.ndarray = field(init=False)
    time: np.ndarray = field(init=False)
    temp: np.ndarray = field(init=False)
    side: np.ndarray = field(init=False)  # (n, a) which way a joint came: -1 to 1

    def __post_init__(self):
        self.q = np.concatenate([run.q for run in self.runs])
        self.run = np.concatenate([np.full(len(run.q), k) for k, run in enumerate(self.runs)])
        self.clamping = np.array([run.clamping for run in self.runs])[self.run]
        self.time = np.concatenate([run.started_s + run.t for run in self.runs])
        rise, seconds, swing, period = self.warmth
        self.temp = 20 + rise * (1 - np.exp(-self.time / seconds)) + swing * np.sin(2 * np.pi * self.time / period)
        self.side = np.concatenate([play(run.q, 1e-4) / 5e-5 for run in self.runs])

    def carriages(self, off: Off) -> np.ndarray:
        """Joints (n, a) behind their gears, without springs."""
        q, warm = self.q, (self.temp - 20)[:, None]
        out = q + off.offset + off.pitch * (q - self.arm.home) + off.growth * warm
        out[:, 1:] += off.coupling[1:] * q[:, :-1]
        if off.hysteresis.any():
            out += np.concatenate([play(run.q, off.hysteresis) for run in self.runs])
        for k in range(HARMONICS if off.curve.any() else 0):
            out += off.curve[:, 2 * k] * np.sin((k + 1) * q) + off.curve[:, 2 * k + 1] * np.cos((k + 1) * q)
        for joint, shift, begin, end in off.disturbance:
            out[:, joint] += shift * ((self.time >= begin) & (self.time < end))
        return out

    def stand(self, off: Off | None = None, odd: Odd | None = None) -> Stand:
        """The arm in all rows."""
        off = off or Off.nothing(self.q.shape[1])
        q = self.carriages(off)
        if odd is None:
            return self.arm.stand(q, off)
        base = None if odd.base is None else odd.size * odd.base
        return self.arm.stand(q + odd.size * odd.shift, off, odd.size * odd.geometry, base)

    def tips(self, off: Off, odd: Odd | None = None) -> np.ndarray:
        """Targets (n, 3) in the machine frame."""
        stand = self.stand(off, odd)
        seat = self.seats[self.clamping] - [0, 0, off.tool]
        if odd is not None:
            seat = seat + odd.size * odd.seat
        out = stand.point + np.einsum("nij,nj->ni", stand.turn, seat)
        return out if odd is None else out + odd.size * odd.seen

    def seen(self, tips: np.ndarray) -> np.ndarray:
        """The same in the frames of the trackers."""
        out = np.empty_like(tips)
        for k, (turn, place) in enumerate(self.trackers):
            rows = self.clamping == k
            out[rows] = (tips[rows] - place) @ turn
        return out


def play(q: np.ndarray, width: np.ndarray | float) -> np.ndarray:
    """Carriages minus encoders (n, a) of joints with play, which begin in the middle of it."""
    half, at, out = np.asarray(width) / 2, q[0], np.zeros(q.shape)
    for k, now in enumerate(q):
        at = np.minimum(np.maximum(at, now - half), now + half)
        out[k] = at - now
    return out


def poses(arm: Arm, way: str, count: int, rng: np.random.Generator) -> np.ndarray:
    """Different poses (count, a) above the floor and within the limits."""
    ur = arm.name == "ur10"
    middle = arm.start + rng.uniform(-1, 1, 6) * ([1.5, 0.35, 0.5, 0.6, 0.6, 1.5] if ur else [0.9, 0.2, 0.2, 1, 0.2, 1])
    half = np.array([1.4, 0.8, 1.1, 1.3, 1.3, 1.6] if ur else [1.2, 0.5, 0.5, 1.2, 0.7, 1.6])
    if ur and way == "joints" and rng.random() < 0.4:
        half = np.array([2.9, 1.3, 2.0, 2.6, 2.6, 3.0])
    found: list[np.ndarray] = []
    many = 0
    for _ in range(30):
        if way in ("joints", "narrow"):
            size = half * (0.45 if way == "narrow" else 1.0)
            q = middle + size * rng.uniform(-1, 1, (3 * count, 6))
        elif way == "swings":
            q = np.repeat(middle[None] + 0.6 * half * rng.uniform(-1, 1, (6, 6)), -(-count // 6), axis=0)
            for j in range(6):
                rows = slice(j * len(q) // 6, (j + 1) * len(q) // 6)
                q[rows, j] = np.linspace(middle[j] - 1.2 * half[j], middle[j] + 1.2 * half[j], len(q[rows]))
        else:
            at = arm.stand(middle[None])
            if way == "grid":
                side = max(2, round(count ** (1 / 3)))
                reach = rng.uniform(300, 700, 3) * (0.6 if ur else 1)
                steps = [np.linspace(-0.5, 0.5, side)] * 3
                point = at.point + np.stack(np.meshgrid(*steps, indexing="ij"), -1).reshape(-1, 3) * reach
                point = np.concatenate([point] * 2)
            else:
                out = rng.normal(size=(3 * count, 3))
                point = at.point + float(rng.uniform(150, 400)) * out / np.linalg.norm(out, axis=1)[:, None]
            lean = rng.uniform(-0.6, 0.6, (3, len(point)))
            turn = at.turn @ turn_x(lean[0]) @ turn_y(lean[1]) @ turn_z(2 * lean[2])
            q, good = arm.inverse(point, turn, np.repeat(middle[None], len(point), 0))
            q = q[good]
        stand = arm.stand(q)
        low = 150.0 if not ur else -250.0
        sane = arm.inside(q) & (stand.point[:, 2] > low) & (stand.behind_point[2:, :, 2] > low).all(0)
        sane &= np.hypot(*stand.point[:, :2].T) > (250 if ur else 600)
        q = q[sane]
        found.append(q)
        many += len(q)
        if many >= count:
            break
        middle = middle + 0.1 * rng.uniform(-1, 1, 6)
    else:
        raise AgainError
    q = np.concatenate(found)
    keep = np.arange(count) if way == "swings" else rng.permutation(len(q))[:count]
    return q[keep]


def visited(q: np.ndarray, visits: int, rng: np.random.Generator) -> np.ndarray:
    """Rows in the order in which they are driven to, most of them again in another order."""
    order = [np.arange(len(q))]
    for _ in range(visits - 1):
        order.append(rng.permutation(len(q))[: max(8, int(rng.uniform(0.3, 1.0) * len(q)))])
    return q[np.concatenate(order)]
