"""Patterns that no library states: what a leftover may depend on, covariate by covariate.

They serve three ends: the noise is measured beside them, an unknown effect is found by them, and they name what it
depends on. A pattern moves a carriage (and so the tip, through the machine's own Jacobian), an encoder, a drive force,
the tip itself, or the dynamometer.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from camcomp.datatypes import Floats
from camcomp.gap.effect import Motion

_DEGREES = 5
_RELAX_MM = (0.5, 3.0)


@dataclass(frozen=True, eq=False)
class Ground:
    """What patterns of one run are made of: rows (n), slopes of the tip by carriage (n, 3, m), model drive force (n, m),
    model force (n, 3), tip path (n, 3) program frame and its rate (n, 3) mm/s, present: channels that were measured."""

    motion: Motion
    slope: Floats
    drive: Floats
    force: Floats
    tip: Floats
    velocity: Floats
    present: dict[str, bool]


def _bounds(values: Sequence[Floats]) -> tuple[Floats, Floats]:
    everything = np.concatenate(values)
    low, high = everything.min(axis=0), everything.max(axis=0)
    return low, np.maximum(high - low, 1e-9)


def _reversal(motion: Motion, length: float, j: int) -> Floats:
    """Decaying memory (n,) of the last reversal of actuator j: 2 at the reversal, signed by the new direction."""
    x, sign = motion.encoder[:, j], np.sign(np.round(motion.direction[:, j], 2))
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))])
    turned = np.concatenate([[False], (sign[1:] != sign[:-1]) & (sign[1:] != 0)])
    last = np.maximum.accumulate(np.where(turned, travelled, -np.inf))
    with np.errstate(over="ignore"):
        return np.where(np.isfinite(last), 2.0 * np.exp(-(travelled - last) / length) * sign, 0.0)


def covariates(grounds: Sequence[Ground], actuators: Sequence[str]) -> dict[str, list[list[Floats]]]:
    """Per covariate label: per run: functions (n,), of size about one, that depend on it."""
    low, span = _bounds([g.motion.encoder for g in grounds])
    fast = np.maximum(np.max([np.abs(g.motion.speed).max(axis=0) for g in grounds], axis=0), 1e-9)
    strong = np.maximum(np.max([np.abs(g.drive).max(axis=0) for g in grounds], axis=0), 1e-9)
    start = min(float(g.motion.common.min()) for g in grounds)
    length = max(max(float(g.motion.common.max()) for g in grounds) - start, 1e-9)
    out: dict[str, list[list[Floats]]] = {}

    def put(label: str, functions: Sequence[Floats]) -> None:
        out.setdefault(label, []).append(list(functions))

    for g in grounds:
        m = g.motion
        t = 2.0 * (m.common - start) / length - 1.0
        for j, a in enumerate(actuators):
            x = 2.0 * (m.encoder[:, j] - low[j]) / span[j] - 1.0
            put(f"position:{a}", [legendre.legval(x, np.eye(_DEGREES + 1)[d]) for d in range(_DEGREES + 1)])
            v = m.speed[:, j] / fast[j]
            put(f"velocity:{a}", [v, v * np.abs(v), np.abs(v)])
            put(f"reversal:{a}", [m.direction[:, j], *(_reversal(m, each, j) for each in _RELAX_MM)])
            d = g.drive[:, j] / strong[j]
            put(f"force:{a}", [d, d * np.abs(d)])
            put(f"time:{a}", [np.ones_like(t), t, 0.5 * (3 * t**2 - 1)])
            if m.ordered and len(m.time) > 2:
                acceleration = np.gradient(m.speed[:, j], m.time)
                put(f"acceleration:{a}", [acceleration / max(np.abs(acceleration).max(), 1e-9)])
            if m.temperature is not None:
                put(f"temperature:{a}", [(m.temperature - 20.0) / 10.0])
    return out


def directions(ground: Ground) -> list[Floats]:
    """Functions (n,) of the feed direction in the plane of the workpiece."""
    speed = np.linalg.norm(ground.velocity, axis=1)
    moving = speed > 1e-3 * max(speed.max(), 1e-9)
    angle = np.arctan2(ground.velocity[:, 1], ground.velocity[:, 0])
    return [np.where(moving, f(k * angle), 0.0) for k in (1, 2) for f in (np.cos, np.sin)]


@dataclass(frozen=True, eq=False)
class Dictionary:
    """labels (p,): covariate of every pattern; kind (p,): channel it moves; blocks: per run (n, c, p), unit size."""

    labels: tuple[str, ...]
    kind: tuple[str, ...]
    blocks: tuple[Floats, ...]


def dictionary(grounds: Sequence[Ground], actuators: Sequence[str], channels: int) -> Dictionary:
    """All patterns of the channels that were measured, in mm and N (1 um, 1 N each)."""
    m = len(actuators)
    parts = covariates(grounds, actuators)
    labels: list[str] = []
    kinds: list[str] = []
    columns: list[list[Floats]] = [[] for _ in grounds]

    def add(label: str, kind: str, values: Sequence[Floats]) -> None:
        if max(float(np.abs(v).max(initial=0.0)) for v in values) == 0.0:
            return
        labels.append(label)
        kinds.append(kind)
        for store, value in zip(columns, values, strict=True):
            store.append(value)

    any_of = {name: any(g.present[name] for g in grounds) for name in grounds[0].present}
    for label, per_run in parts.items():
        j = list(actuators).index(label.split(":")[1])
        for i in range(len(per_run[0])):
            f = [functions[i] for functions in per_run]
            if any_of["tip"]:
                add(label, "tip", [_tip(g.slope[:, :, j] * v[:, None] * 1e-3, channels) for g, v in zip(grounds, f, strict=True)])
            if any_of["encoder"] and not label.startswith("force"):
                add(label, "encoder", [_one(v * 1e-3, 3 + j, channels) for v in f])
            if any_of["drive"]:
                add(label, "drive", [_one(v, 3 + m + j, channels) for v in f])
    for axis, name in enumerate("xyz"):
        turns = [directions(g) for g in grounds]
        for i in range(len(turns[0])):
            if any_of["tip"]:
                add(f"direction:{name}", "tip", [_one(t[i] * 1e-3, axis, channels) for t in turns])
        if any_of["dyno"]:
            add(f"force:{name}", "dyno", [_one(g.force[:, axis] / 100.0, 3 + 2 * m + axis, channels) for g in grounds])
            add(f"time:{name}", "dyno", [_one(g.force[:, axis] / 100.0 * g.motion.common / 60.0, 3 + 2 * m + axis, channels) for g in grounds])
    blocks = tuple(np.stack(store, axis=2) if store else np.zeros((0, channels, 0)) for store in columns)
    return Dictionary(tuple(labels), tuple(kinds), blocks)


def _tip(values: Floats, channels: int) -> Floats:
    out = np.zeros((len(values), channels))
    out[:, :3] = values
    return out


def _one(values: Floats, channel: int, channels: int) -> Floats:
    out = np.zeros((len(values), channels))
    out[:, channel] = values
    return out
