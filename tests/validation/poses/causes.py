"""What can be off: effects of the library that poses can show, faults that none describes, and what looks alike.

`amount` is the one number of an effect that is scaled until the target moves as far as it should.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tests.validation.poses.arm import HARMONICS, Off
from tests.validation.poses.plant import Odd, Plant

Key = tuple[str, str | None]
SHIFTS = ("x_mm", "y_mm", "z_mm", "tilt_x_deg", "tilt_y_deg")
LOW_HIGH = {  # what the library takes for possible
    "joint_offset": (-0.1, 0.1),
    "screw_pitch": (-0.02, 0.02),
    "joint_coupling": (-2, 2),
    "joint_hysteresis": (0, 0.01),
    "backlash": (0, 0.01),
    "friction": (0, np.inf),
    "gravity_compliance": (0, 1e-5),
    "gravity": (0, 5000),
    "link_length": (-10, 10),
}


@dataclass
class Item:
    """One effect on one target: its parameters at an amount, the amount it begins with, and how far it may go."""

    effect: str
    target: str | None
    parameters: Callable[[float], dict]
    unit: float
    high: float
    signed: bool = True
    low: float = 0.0
    side: Callable[[Off, float], None] = lambda off, x: None
    shape: dict | None = None  # what the library's parameters do not say

    @property
    def key(self) -> Key:
        return self.effect, self.target

    def put(self, off: Off, amount: float) -> Off:
        """The arm with this effect more."""
        off = off.copy()
        self.side(off, amount)
        return off


def library(plant: Plant, rng: np.random.Generator) -> list[Item]:
    """Effects that static poses of this arm can show, with their side parameters drawn."""
    arm, items = plant.arm, []
    springs = np.isfinite(arm.stiffness).all()

    def add(effect, target, parameters, unit, high, side, signed=True, low=0.0):
        items.append(Item(effect, target, parameters, unit, high, signed, low, side))

    def into(name: str, at, scale: float = 1.0):
        def side(off: Off, x: float) -> None:
            getattr(off, name)[at] += x * scale

        return side

    for j, name in enumerate(arm.names):
        add("joint_offset", name, lambda x: {"offset_rad": x}, 1e-4, 0.02, into("offset", j))
        add("screw_pitch", name, lambda x: {"error_ppm": x}, 100.0, 5000, into("pitch", j, 1e-6))
        add("joint_hysteresis", name, lambda x: {"width_rad": x}, 1e-4, 0.004, into("hysteresis", j), False)
        phase, second = rng.uniform(0, 2 * np.pi, 2)
        pair = np.array([np.cos(second), np.sin(second)]) if rng.random() < 0.4 else np.eye(2)[int(rng.random() < 0.5)]

        def curve(off: Off, x: float, j=j, phase=phase, pair=pair) -> None:
            for k in range(2):  # rms over a turn is x
                off.curve[j, 2 * k : 2 * k + 2] += np.sqrt(2) * x * pair[k] * np.array([np.cos(phase), np.sin(phase)])

        add("joint_curve", name, lambda x: {"amplitude_rad": x}, 1e-4, 0.004, curve, False)
        items[-1].shape = {"shares": pair.tolist(), "phase_rad": float(phase)}  # of the first and the second harmonic
        add("thermal_growth", name, lambda x: {"growth_rad_per_K": x}, 1e-5, 3e-4, into("growth", j))
        if j >= 4:
            add("joint_coupling", name, lambda x: {"factor": x}, 1e-3, 0.02, into("coupling", j))
        if (arm.a[j] != 0) != (arm.d[j] != 0):
            add("link_length", name, lambda x: {"length_mm": x}, 0.1, 5, into("length", j))
        mix = rng.normal(size=5) * (rng.random(5) < 0.45)
        mix = mix if mix.any() else np.eye(5)[int(rng.integers(5))]
        mix = mix / np.linalg.norm(mix) * [1, 1, 1, 0.06, 0.06]

        def geometry(off: Off, x: float, j=j, mix=mix) -> None:
            off.geometry[j] += x * mix * [1, 1, 1, np.pi / 180, np.pi / 180]

        def said(x: float, mix=mix) -> dict:
            return {key: x * m for key, m in zip(SHIFTS, mix, strict=True)}

        add("link_geometry", name, said, 0.1, 6, geometry)
        soft = 3e-9 if arm.name == "ur10" else 2e-11
        add(
            "gravity_compliance",
            name,
            lambda x: {"compliance_rad_per_Nmm": x},
            soft,
            3e-7 if arm.name == "ur10" else 1e-8,
            into("compliance", j),
            False,
        )
        if springs:
            add(
                "drive_stiffness",
                name,
                lambda x: {"factor": 1 + x},
                0.1,
                2.0,
                into("stiffness", j),
                True,
                -0.7,
            )
    add("thermal_growth", None, lambda x: {"growth_rad_per_K": x}, 1e-5, 3e-4, into("growth", slice(None)))
    if springs:

        def weight(off: Off, x: float) -> None:
            off.weight += x

        add("gravity", None, lambda x: {"weight_N": x}, 50.0, 4000, weight, False)
    return items


def disturbed(plant: Plant, rng: np.random.Generator) -> Item:
    """A joint that is shifted for a while within one run."""
    j, number = int(rng.integers(5)), int(rng.integers(len(plant.runs)))
    times = plant.time[plant.run == number]
    first = int(rng.uniform(0.1, 0.6) * len(times))
    last = first + int(rng.uniform(0.2, 0.35) * len(times))
    begin, end = (float(0.5 * (times[k] + times[k - 1])) for k in (first, last))

    def side(off: Off, x: float) -> None:
        off.disturbance = [*off.disturbance, (j, x, begin, end)]

    return Item(
        "disturbance",
        plant.arm.names[j],
        lambda x: {"shift_rad": x, "from_s": begin, "to_s": end},
        1e-4,
        0.01,
        side=side,
    )


def rms(values: np.ndarray) -> float:
    """3-D rms in um of (n, 3) mm."""
    return 1e3 * float(np.sqrt((values**2).sum(1).mean()))


class Local:
    """Sensitivities of the target at the nominal arm."""

    def __init__(self, plant: Plant):
        self.plant = plant
        self.off = Off.nothing()
        self.base = plant.tips(self.off)
        self.stand = plant.stand(self.off)
        self.shares = np.cross(self.stand.axis, self.base - self.stand.joint_point)  # (a, n, 3) mm per rad

    @cached_property
    def frames(self) -> np.ndarray:
        """Orthonormal columns (3 n, k) of the positions of trackers and targets, clamping by clamping."""
        columns = []
        for k in np.unique(self.plant.clamping):
            here = (self.plant.clamping == k).astype(float)
            place = self.base - self.base[here > 0].mean(0)
            for axis in range(3):
                way = np.eye(3)[axis]
                columns.append(here[:, None] * way)
                columns.append(here[:, None] * np.cross(way, place) * 1e-3)
                columns.append(here[:, None] * self.stand.turn[:, :, axis])
        u, s, _ = np.linalg.svd(np.array([c.ravel() for c in columns]).T, full_matrices=False)
        return u[:, s > 1e-9 * s[0]]

    def free(self, change: np.ndarray) -> np.ndarray:
        """What frames leave of a change (n, 3) or of columns (3 n, k)."""
        flat = change.ravel() if change.shape[1:] == (3,) else change
        return (flat - self.frames @ (self.frames.T @ flat)).reshape(change.shape)

    def of(self, item: Item, amount: float, odd: Odd | None = None) -> np.ndarray:
        """Change (n, 3) by an effect alone."""
        return self.plant.tips(item.put(self.off, amount), odd) - self.base

    def group(self, effect: str, target: str | None, waves: int = HARMONICS) -> np.ndarray:
        """Columns (3 n, k) of an effect, in mm per unit of its parameters (rad for angles)."""
        plant, out = self.plant, []
        j = plant.arm.names.index(target) if target in plant.arm.names else 0
        share, q = self.shares[j] if target else self.shares.sum(0), plant.q[:, j]
        seconds = plant.time - plant.time.min()
        if effect == "joint_offset":
            out = [share]
        elif effect == "screw_pitch":
            out = [share * (q - plant.arm.home[j])[:, None]]
        elif effect == "joint_coupling":
            out = [share * plant.q[:, j - 1, None]]
        elif effect in ("joint_hysteresis", "backlash", "friction"):
            out = [share * plant.side[:, j, None] / 2]
        elif effect == "joint_curve":
            out = [share * f((k + 1) * q)[:, None] for k in range(waves) for f in (np.sin, np.cos)]
        elif effect == "thermal_growth":
            out = [share * (plant.temp - 20)[:, None]]
            out += [share * (1 - np.exp(-seconds / s))[:, None] for s in (900, 3600, 14400)]
        elif effect == "link_length":
            out = [self.stand.along[j]]
        elif effect == "link_geometry":
            r = self.stand.behind_turn[j]
            out = [r[:, :, k] for k in range(3)]
            out += [np.cross(r[:, :, k], self.base - self.stand.behind_point[j]) for k in range(2)]
        elif effect in ("gravity_compliance", "drive_stiffness"):
            out = [share * self.stand.load[:, j, None] * 1e-6]
        elif effect == "gravity":
            out = [self.plant.tips(_heavier(self.off)) - self.base]
        return np.array([c.ravel() for c in out]).T

    def groups(self) -> list[Key]:
        """All effects with a target that rows of poses can show."""
        springs = np.isfinite(self.plant.arm.stiffness).all()
        effects = ["joint_offset", "screw_pitch", "joint_hysteresis", "backlash", "joint_curve", "thermal_growth"]
        effects += ["link_length", "link_geometry", "gravity_compliance"]
        effects += ["friction", "drive_stiffness"] if springs else []
        keys: list[Key] = [(effect, name) for effect in effects for name in self.plant.arm.names]
        keys += [("joint_coupling", name) for name in self.plant.arm.names[3:]]
        keys.append(("thermal_growth", None))
        return keys + ([("gravity", None)] if springs else [])

    def span(self, since: float | None = None) -> np.ndarray:
        """Everything the library could fit at once, free of frames, of length one; with steps in time at `since`."""
        again = ("backlash", "friction", "drive_stiffness", "link_length")
        columns = [self.group(*key, waves=2 * HARMONICS) for key in self.groups() if key[0] not in again]
        if since is not None:
            late = (self.plant.time >= since)[None, :, None]
            columns += [(self.shares * late).reshape(len(self.shares), -1).T]
        whole = np.column_stack(columns)
        matrix = self.free(whole)
        size = np.linalg.norm(matrix, axis=0)
        keep = size > 1e-6 * np.linalg.norm(whole, axis=0)
        return matrix[:, keep] / size[keep]


def _heavier(off: Off) -> Off:
    off = off.copy()
    off.weight += 1.0
    return off


def remains(span: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Residual of a change (n, 3), free of frames, after a least-squares fit of the span."""
    fit, *_ = np.linalg.lstsq(span, change.ravel(), rcond=1e-5)
    return (change.ravel() - span @ fit).reshape(change.shape)


ODDS = (
    "soft_ground",
    "target_slip",
    "range_scale",
    "foreign_load",
    "link_swing",
    "axis_wobble",
    "cable",
    "azimuth_error",
    "hard_spring",
    "rocking_seat",
    "tracker_walk",
    "two_joint_wave",
    "cold_oil",
)


def strange(plant: Plant, local: Local, name: str, rng: np.random.Generator) -> Odd:
    """A fault that no effect describes, of size one in its own unit (mm or rad at an arm of a metre)."""
    n, names = len(plant.q), plant.arm.names
    q, small = plant.q, 1e-4
    j = int(rng.integers(1, 5))
    phase = float(rng.uniform(0, 2 * np.pi))
    zero, rate = np.zeros((n, 6)), (plant.time - plant.time.min()) / max(np.ptp(plant.time), 1.0)
    heavy = local.stand.load / np.maximum(np.abs(local.stand.load).max(0), 1e-9)
    flange = plant.stand(local.off)
    down = -flange.turn[:, 2, :]  # machine -z in the platform
    place = plant.seen(local.base)

    def joint(values: np.ndarray, at: int = j) -> np.ndarray:
        out = zero.copy()
        out[:, at] = small * values
        return out

    if name == "soft_ground":
        about = np.array([np.cos(phase), np.sin(phase), 0])
        over = local.base @ np.cross([0, 0, 1.0], about) / 1000
        soft = np.maximum(over, 0) ** 2 - 0.4 * np.maximum(-over, 0)
        return Odd(name, None, {"about_rad": phase}, base=small * soft[:, None] * about)
    if name == "target_slip":
        moment = float(np.quantile(plant.time, rng.uniform(0.3, 0.7))) + 0.5
        way = rng.normal(size=3)
        number = plant.run[np.searchsorted(plant.time, moment) - 1]
        late = (plant.time >= moment) & (plant.clamping == plant.runs[number].clamping)
        say = {"at_s": moment, "way": way.tolist()}
        return Odd(name, None, say, seat=0.1 * late[:, None] * way, since=moment)
    if name == "range_scale":
        far = np.linalg.norm(place, axis=1)
        rel = (far - far.mean()) / 300
        drift = np.sin(2.3 * rel + phase) + 0.6 * rel**2
        turns = np.array([plant.trackers[k][0] for k in plant.clamping])
        way = np.einsum("nij,nj->ni", turns, place / far[:, None])
        return Odd(name, None, {"phase": phase}, seen=0.1 * drift[:, None] * way)
    if name == "foreign_load":
        other = int(rng.choice([k for k in (1, 2, 3, 4) if k != j]))
        level = float(np.quantile(heavy[:, other], rng.uniform(0.3, 0.7)))
        width = 0.1 * float(np.ptp(heavy[:, other])) + 1e-9
        say = {"load_of": names[other], "level": level}
        return Odd(name, names[j], say, shift=joint(np.tanh((heavy[:, other] - level) / width)))
    if name == "link_swing":
        bend = np.zeros((n, 6, 5))
        turns = float(rng.uniform(1.5, 4))
        bend[:, j, int(rng.integers(2))] = 0.1 * np.sin(2 * np.pi * turns * rate**1.4 + phase)
        return Odd(name, names[j], {"swings": turns, "phase": phase}, geometry=bend)
    if name == "axis_wobble":
        wobble = np.zeros((n, 6, 5))
        times = int(rng.choice([1, 2, 3]))
        wobble[:, j - 1, 3 + int(rng.integers(2))] = small * np.cos(times * q[:, j] + phase)
        return Odd(name, names[j], {"times": times, "phase": phase}, geometry=wobble)
    if name == "cable":
        other = int(rng.choice([k for k in (0, 1, 2, 3) if k != j]))
        at = [float(np.quantile(q[:, k], rng.uniform(0.35, 0.65))) for k in (j, other)]
        signs = rng.choice([-1, 1], 2)
        tight = ((q[:, j] - at[0]) * signs[0] > 0) & ((q[:, other] - at[1]) * signs[1] > 0)
        return Odd(name, names[j], {"with": names[other], "beyond_rad": at}, shift=joint(tight.astype(float)))
    if name == "azimuth_error":
        azimuth = np.arctan2(place[:, 1], place[:, 0])
        spread = max(0.3, float(np.ptp(azimuth)))
        waves = float(rng.uniform(2, 4)) * 2 * np.pi / min(spread, 2 * np.pi)
        across = np.column_stack([-place[:, 1], place[:, 0], np.zeros(n)]) / 2000
        turns = np.array([plant.trackers[k][0] for k in plant.clamping])
        seen = np.einsum("nij,nj->ni", turns, across) * np.sin(waves * azimuth + phase)[:, None]
        return Odd(name, None, {"waves_per_rad": waves, "phase": phase}, seen=0.1 * seen)
    if name == "hard_spring":
        j = int(rng.choice([1, 2]))
        level = float(np.quantile(heavy[:, j], rng.uniform(0.4, 0.7)))
        over = np.maximum(heavy[:, j] - level, 0) / max(float(np.ptp(heavy[:, j])), 1e-9)
        dip = np.minimum(over, 0.12) / 0.12
        return Odd(name, names[j], {"level": level}, shift=joint(dip, j))
    if name == "rocking_seat":
        lean = rng.normal(size=3)
        lean, way = lean / np.linalg.norm(lean), rng.normal(size=3)
        level = float(np.median(down @ lean))
        say = {"lean": lean.tolist(), "way": way.tolist(), "level": level}
        return Odd(name, None, say, seat=0.1 * np.sign(down @ lean - level)[:, None] * way)
    if name == "tracker_walk":
        way, turns = rng.normal(size=3), float(rng.uniform(1.5, 4))
        sway = np.sin(2 * np.pi * turns * rate + phase)
        yaw = np.cross([0, 0, 1.0], local.base - local.base.mean(0)) / 500
        say = {"swings": turns, "phase": phase, "way": way.tolist()}
        return Odd(name, None, say, seen=0.1 * sway[:, None] * (way + yaw * rng.normal()))
    if name == "two_joint_wave":
        other = int(rng.choice([k for k in (1, 2, 3, 4) if k != j]))
        times = [float(v) for v in rng.choice([-3, -2, 2, 3], 2)]
        wave = np.sin(times[0] * q[:, j] + times[1] * q[:, other] + phase)
        return Odd(name, names[j], {"with": names[other], "times": times, "phase": phase}, shift=joint(wave))
    # cold_oil: how far a joint stops short depends on how long it has stood before, and on how far it came.
    wait = np.concatenate([np.diff(run.t, prepend=run.t[0] - 10) for run in plant.runs])
    came = np.concatenate([np.abs(np.diff(run.q[:, j], prepend=run.q[0, j])) for run in plant.runs])
    short = np.tanh(came / 0.3) * np.log(np.maximum(wait, 1.0)) ** 2 / 5
    return Odd("cold_oil", names[j], {}, shift=joint(short - short.mean()))


def loose(local: Local, keys: list[Key], key: Key, change: np.ndarray, sigma_mm: float) -> list[bool]:
    """Which parameters of one of the causes in `keys` the rows leave free, the frames and the other causes unknown.

    change (n, 3): what the cause does. Free is what has a deviation of a third of its value, or of what is usual.
    """
    groups = [local.group(*k) for k in [key, *[k for k in keys if k != key]]]
    part = {"thermal_growth": slice(1), "joint_curve": slice(4)}
    groups[0] = groups[0][:, part.get(key[0], slice(None))]
    values, *_ = np.linalg.lstsq(groups[0], change.ravel(), rcond=1e-9)
    usual = np.array([0.5, 0.5, 0.5, 5e-4, 5e-4]) if key[0] == "link_geometry" else np.linalg.norm(values)
    here, matrix = groups[0].shape[1], np.column_stack([local.free(each) for each in groups])
    size = np.linalg.norm(matrix, axis=0)
    out = []
    for k in range(here):
        others = np.delete(matrix / np.maximum(size, 1e-12), k, axis=1)
        fit, *_ = np.linalg.lstsq(others, matrix[:, k], rcond=1e-8)
        left = np.linalg.norm(matrix[:, k] - others @ fit)
        out.append(bool(sigma_mm > 0.33 * left * np.maximum(np.abs(values[k]), np.broadcast_to(usual, here)[k])))
    return out


def by_another_name(local: Local, change: np.ndarray) -> list[Key]:
    """Groups that by themselves do all but a fifth (rms) of a change (n, 3), whatever its size."""
    aim, found = local.free(change).ravel(), list[Key]()
    for key in local.groups():
        own = local.free(local.group(*key))
        own = own / np.maximum(np.linalg.norm(own, axis=0), 1e-12)
        left = aim - own @ np.linalg.lstsq(own, aim, rcond=1e-6)[0]
        if np.linalg.norm(left) < 0.2 * np.linalg.norm(aim):
            found.append(key)
    return found


def alike(local: Local, causes: list[Key], change: np.ndarray, sigma_mm: float) -> list[list[Key]]:
    """Sets of causes that do what `causes` do (change (n, 3)) within the noise, together with small errors of every kind."""
    keys = local.groups()
    whole = {key: local.group(*key) / sigma_mm for key in keys}
    blocks = {key: local.free(b) for key, b in whole.items()}
    blocks = {key: b for key, b in blocks.items() if np.linalg.norm(b) > 1e-6 * np.linalg.norm(whole[key])}
    rows = len(change)
    small = np.column_stack(list(blocks.values()))
    size = np.linalg.norm(small, axis=0)
    seen = size > 1e-6 * np.linalg.norm(np.column_stack([whole[key] for key in blocks]), axis=0)
    small = small[:, seen] / size[seen] * np.sqrt(3 * rows) * 0.05
    aim = local.free(change).ravel() / sigma_mm
    # Prior of the small errors: (1 + S S')^-1 = 1 - S (1 + S'S)^-1 S'.
    inner = np.linalg.inv(np.eye(small.shape[1]) + small.T @ small)
    with_small = small.T

    def weigh(values: np.ndarray) -> np.ndarray:
        return values - small @ (inner @ (with_small @ values))

    known = [key for key in causes if key in blocks]
    if len(known) < len(causes):
        return [causes]  # a cause of its own kind: nothing else is asked for
    own = np.column_stack([blocks[k] for k in known])
    own = own / np.linalg.norm(own, axis=0).clip(1e-12)
    aim = own @ np.linalg.lstsq(own, aim, rcond=1e-6)[0]  # to first order, as all that it is compared with
    aimed = weigh(aim)
    heavy = {key: weigh(b) for key, b in blocks.items()}

    def misses(some: list[Key], bounds: bool = True) -> float:
        a, w = np.column_stack([blocks[k] for k in some]), np.column_stack([heavy[k] for k in some])
        scale = np.maximum(np.linalg.norm(a, axis=0), 1e-12)
        normal, right = (a / scale).T @ (w / scale), (a / scale).T @ aimed
        fit, *_ = np.linalg.lstsq(normal, right, rcond=1e-8)
        values, at = fit / scale, 0
        for key in some if bounds else ():
            width = blocks[key].shape[1]
            low, high = LOW_HIGH.get(key[0], (-np.inf, np.inf))
            if width == 1 and not low <= values[at] * (1e-6 if key[0] == "gravity_compliance" else 1) <= high:
                return np.inf
            if key[0] == "link_geometry" and (np.abs(values[at : at + 5]) > [20, 20, 20, 0.09, 0.09]).any():
                return np.inf
            at += width
        return float(aim @ aimed - 2 * fit @ right + fit @ normal @ fit)

    limit = max(0.0, misses(known, bounds=False)) + 9.0
    found: list[list[Key]] = [known]
    singles = {key: misses([key]) for key in blocks} if len(known) <= 2 else {}
    found += [[key] for key, miss in singles.items() if miss < limit and [key] != known]
    for k in range(len(known) if len(known) > 1 else 0):
        rest = known[:k] + known[k + 1 :]
        for key in blocks:
            if key not in known and misses([*rest, key]) < limit:
                found.append([*rest, key])
    return found
