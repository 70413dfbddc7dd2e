"""Patterns that no library states: covariates on which a residual may depend.

They serve three ends: the noise is measured jointly with them, an unknown effect is found by them, and they name the
covariates that it depends on. A pattern moves a carriage (and so the tip, through the machine's own Jacobian), an encoder, a drive force,
the tip itself, or the dynamometer.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from camcomp.diagnosis.model.noise import REPEATABILITY_MM
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion

_KNOTS = 12  # hats along the travel of an actuator
_PLACES = 20  # hats along an axis of the workpiece: a bump of a tenth of the travel is still seen
_MOMENTS = 24  # hats along the time of all runs
_MOVES = 1e-3  # of the highest speed, from which on something moves
_RELAX_MM = (0.5, 3.0)
KINDS = ("tip", "encoder", "drive", "dyno")


@dataclass(frozen=True, eq=False, kw_only=True)
class Ground:
    """What patterns of one run are made of: motion at its rows (n), model drive force (n, m), model force (n, 3), rate of
    the tip (n, 3) mm/s in the program frame, and which channels were measured.
    """

    motion: Motion
    drive: Floats
    force: Floats
    tip: Floats  # (n, 3) mm, program frame
    velocity: Floats
    present: dict[str, bool]


@dataclass(frozen=True, eq=False)
class Dictionary:
    """Patterns of one kind of channel. labels (p,): covariate; blocks: per run (c n, p), c channels from `first` on."""

    kind: str
    first: int
    labels: tuple[str, ...]
    blocks: tuple[ByChannel, ...]


def _reversal(motion: Motion, length: float, j: int) -> Floats:
    """Decaying memory (n,) of the last reversal of actuator j: 2 at the reversal, signed by the new direction."""
    x, sign = motion.encoder[:, j], np.sign(np.round(motion.direction[:, j], 2))
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))])
    turned = np.concatenate([[False], (sign[1:] != sign[:-1]) & (sign[1:] != 0)])
    last = np.maximum.accumulate(np.where(turned, travelled, -np.inf))
    with np.errstate(over="ignore"):
        return np.where(np.isfinite(last), 2.0 * np.exp(-(travelled - last) / length) * sign, 0.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Sizes:
    """Scales, over all runs, that make covariates dimensionless."""

    low: Floats
    span: Floats
    fast: Floats
    strong: Floats
    start: float
    length: float


def _sizes(grounds: Sequence[Ground]) -> _Sizes:
    position = np.concatenate([g.motion.encoder for g in grounds])
    low = position.min(axis=0)
    start = min(float(g.motion.common.min()) for g in grounds)
    return _Sizes(
        low=low, span=np.maximum(position.max(axis=0) - low, 1e-9),
        fast=np.maximum(np.max([np.abs(g.motion.speed).max(axis=0) for g in grounds], axis=0), 1e-9),
        strong=np.maximum(np.max([np.abs(g.drive).max(axis=0) for g in grounds], axis=0), 1e-9), start=start,
        length=max(max(float(g.motion.common.max()) for g in grounds) - start, 1e-9),
    )  # fmt: skip


def _of_actuator(g: Ground, size: _Sizes, j: int, knots: int) -> dict[str, list[Floats]]:
    """Functions (n,) of about size one of the motion and force of actuator j, by covariate."""
    m = g.motion
    x = (m.encoder[:, j] - size.low[j]) / size.span[j]
    v = m.speed[:, j] / size.fast[j]
    d = g.drive[:, j] / size.strong[j]
    out = {
        "position": hats(x, knots),
        "velocity": [v, v * np.abs(v), np.abs(v)],
        "reversal": [m.direction[:, j], *(_reversal(m, each, j) for each in _RELAX_MM)],
        "force": [d, d * np.abs(d)],
    }
    push = np.gradient(m.speed[:, j], m.time) if m.ordered and len(m.time) > 2 else np.zeros(len(m.time))
    out["acceleration"] = [push / max(float(np.abs(push).max(initial=0.0)), 1e-9)]
    return out


def hats(x: Floats, knots: int) -> list[Floats]:
    """Piecewise linear functions (n,) that are 1 at one knot and 0 at the others, for x (n,) in 0 .. 1."""
    return [np.maximum(1.0 - np.abs(x * (knots - 1) - n), 0.0) for n in range(knots)]


def _of_time(g: Ground, size: _Sizes, *, warmth: bool) -> dict[str, list[Floats]]:
    """Functions (n,) of time, and of temperature where some run logged it; zero in runs that did not."""
    t = 2.0 * (g.motion.common - size.start) / size.length - 1.0
    own = g.motion.time - g.motion.time[0]
    u = 2.0 * own / max(float(own[-1]), 1e-9) - 1.0
    out = {"time": [np.ones_like(t), t, 0.5 * (3 * t**2 - 1), u, 0.5 * (3 * u**2 - 1)]}
    if warmth:
        logged = g.motion.temperature
        out["temperature"] = [np.zeros_like(t) if logged is None else (logged - 20.0) / 10.0]
    return out


def _of_direction(g: Ground) -> list[Floats]:
    """Functions (n,) of the feed direction in the plane of the workpiece."""
    speed = np.linalg.norm(g.velocity, axis=1)
    moving = speed > _MOVES * max(float(speed.max()), 1e-9)
    angle = np.arctan2(g.velocity[:, 1], g.velocity[:, 0])
    return [np.where(moving, f(k * angle), 0.0) for k in (1, 2) for f in (np.cos, np.sin)]


class _Store:
    """Collects patterns of one kind in its unit, um or N; patterns that are zero in every run are dropped."""

    def __init__(self, kind: str, first: int, width: int, runs: int) -> None:
        self.kind, self.first, self.width = kind, first, width
        self.size = 1e-3 if kind in ("tip", "encoder") else 1.0
        self.labels: list[str] = []
        self.channels: list[int] = []
        self.columns: list[list[Floats]] = [[] for _ in range(runs)]

    def put(self, label: str, channels: Iterable[int], functions: Iterable[Sequence[Floats]]) -> None:
        """Add every function, of every run, to each of the channels."""
        each = [
            per_run
            for per_run in zip(*functions, strict=True)
            if any(np.abs(v).max(initial=0.0) >= 1e-12 for v in per_run)
        ]
        for per_run, channel in product(each, channels):
            self.labels.append(label)
            self.channels.append(channel)
            for store, values in zip(self.columns, per_run, strict=True):
                store.append(self.size * values)

    def done(self) -> Dictionary:
        return Dictionary(self.kind, self.first, tuple(self.labels), tuple(map(self._block, self.columns)))

    def _block(self, columns: Sequence[Floats]) -> ByChannel:
        every = np.array(self.channels, int)
        each = np.stack(columns, axis=1) if columns else np.zeros((0, 0))
        mine = [np.flatnonzero(every == channel) for channel in range(self.width)]
        return ByChannel(len(every), tuple((on, each[:, on]) for on in mine))


def dictionary(grounds: Sequence[Ground], actuators: Sequence[str]) -> list[Dictionary]:
    """All patterns of the channels that were measured; unit size is 1 um or 1 N."""
    size, m = _sizes(grounds), len(actuators)
    rows = sum(len(g.tip) for g in grounds)
    knots = int(np.clip(rows / 250, 4, _KNOTS))
    every = [
        _Store("tip", 0, 3, len(grounds)), _Store("encoder", 3, m, len(grounds)),
        _Store("drive", 3 + m, m, len(grounds)), _Store("dyno", 3 + 2 * m, 3, len(grounds)),
    ]  # fmt: skip
    stores = {store.kind: store for store in every if any(g.present[store.kind] for g in grounds)}
    for j, a in enumerate(actuators):
        for kind, store in stores.items():
            if kind == "dyno":
                continue
            per_run = [_of_actuator(g, size, j, 5 if kind == "encoder" else knots) for g in grounds]
            for name in [name for name in per_run[0] if (kind, name) != ("encoder", "force")]:
                # a displaced carriage moves the tip in any direction
                store.put(f"{name}:{a}", range(3) if kind == "tip" else (j,), [f[name] for f in per_run])
    warmth = any(g.motion.temperature is not None for g in grounds)
    times = [_of_time(g, size, warmth=warmth) for g in grounds]
    for kind, store in stores.items():
        for channel, of in enumerate("xyz" if kind in ("tip", "dyno") else actuators):
            for name in times[0]:
                store.put(f"{name}:{of}", (channel,), [functions[name] for functions in times])
    if "tip" in stores:
        _put_moments_and_places(stores["tip"], grounds, rows)
    turns = [_of_direction(g) for g in grounds]
    for axis, name in enumerate("xyz"):
        loads = [[g.force[:, axis] / 100.0] for g in grounds]
        for kind, store in stores.items():
            if kind in ("tip", "dyno"):
                store.put(f"direction:{name}", (axis,), turns)
                store.put(f"force:{name}", range(3) if kind == "tip" else (axis,), loads)
    return [store.done() for store in stores.values()]


def _put_moments_and_places(tip: _Store, grounds: Sequence[Ground], rows: int) -> None:
    """Add hats over the measured time, one run after the other, and over the axes of the workpiece."""
    spent = [g.motion.time - g.motion.time[0] for g in grounds]
    begin = np.concatenate([[0.0], np.cumsum([float(t[-1]) for t in spent])])
    knots, places_of = int(np.clip(rows / 100, 4, _MOMENTS)), int(np.clip(rows / 150, 4, _PLACES))
    moments = [hats((b + t) / max(float(begin[-1]), 1e-9), knots) for b, t in zip(begin, spent, strict=False)]
    for i, (channel, axis) in product(range(knots), enumerate("xyz")):
        tip.put(f"time:{axis}", (channel,), [[each[i]] for each in moments])
    places = np.concatenate([g.tip for g in grounds])
    low, span = places.min(axis=0), np.ptp(places, axis=0)
    for k in np.flatnonzero(span >= REPEATABILITY_MM):
        tip.put(f"position:{'xyz'[k]}", range(3), [hats((g.tip[:, k] - low[k]) / span[k], places_of) for g in grounds])
