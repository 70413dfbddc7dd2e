"""Functions of one covariate each on which a residual may depend: the dictionary of model/discrepancy for runs of programs.

An unknown effect is found by them, and they name the covariates that it depends on. A function moves a carriage (and so the
tip, in any direction), an encoder, a drive force, the tip itself, or the dynamometer.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from camcomp.diagnosis.model.discrepancy import ORDERS, smooth_functions
from camcomp.diagnosis.model.noise import REPEATABILITY_MM
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion

_FINER = 2 * ORDERS  # cosines over a travel, and over the time of all runs
_MOVES = 1e-3  # of the highest speed, from which on something moves
_RELAX_MM = (0.5, 3.0)
KINDS = ("tip", "encoder", "drive", "dyno")
Functions = list[list[Floats]]  # (n,) per run and function


@dataclass(frozen=True, eq=False, kw_only=True)
class Ground:
    """What functions of one run are made of: motion at its rows (n), model drive force (n, m), model force (n, 3), place (n, 3) mm
    and rate (n, 3) mm/s of the tip in the program frame, and which channels were measured.
    """

    motion: Motion
    drive: Floats
    force: Floats
    tip: Floats
    velocity: Floats
    present: dict[str, bool]


@dataclass(frozen=True, eq=False)
class Dictionary:
    """Functions of one kind of channel. labels (p,): covariate; blocks: per run (c n, p), c channels from `first` on."""

    kind: str
    first: int
    labels: tuple[str, ...]
    blocks: tuple[ByChannel, ...]


def _smooth(values: Sequence[Floats | None], orders: int = ORDERS, least: float = 1e-9) -> Functions:
    """Smooth functions of a covariate (n,) per run over its range; none where it varies by less than `least`.

    None: a run that did not log it, whose functions are 0.
    """
    known = np.concatenate([v for v in values if v is not None] or [np.zeros(1)])
    low, high = float(known.min()), float(known.max())
    if high - low < least:
        return [[] for _ in values]
    return [[] if v is None else list(smooth_functions(v, low, high, orders).T) for v in values]


def _reversal(motion: Motion, length: float, j: int) -> Floats:
    """Decaying memory (n,) of the last reversal of actuator j: 2 at the reversal, signed by the new direction."""
    x, sign = motion.encoder[:, j], np.sign(np.round(motion.direction[:, j], 2))
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(x)))])
    turned = np.concatenate([[False], (sign[1:] != sign[:-1]) & (sign[1:] != 0)])
    last = np.maximum.accumulate(np.where(turned, travelled, -np.inf))
    with np.errstate(over="ignore"):
        return np.where(np.isfinite(last), 2.0 * np.exp(-(travelled - last) / length) * sign, 0.0)


def _of_actuator(grounds: Sequence[Ground], j: int) -> dict[str, Functions]:
    """Functions of the motion and force of actuator j, by covariate."""
    motions = [g.motion for g in grounds]
    rates = [np.gradient(m.speed[:, j], m.time) if m.ordered and len(m.time) > 2 else 0.0 * m.time for m in motions]
    return {
        "position": _smooth([m.encoder[:, j] for m in motions], _FINER),
        "velocity": _smooth([m.speed[:, j] for m in motions]),
        "reversal": [[m.direction[:, j], *(_reversal(m, each, j) for each in _RELAX_MM)] for m in motions],
        "force": _smooth([g.drive[:, j] for g in grounds]),
        "acceleration": _smooth(rates),
    }


def _of_time(grounds: Sequence[Ground]) -> dict[str, Functions]:
    """Functions of time (common clock, own time of a run, measured time one run after the other), and of temperature."""
    motions = [g.motion for g in grounds]
    spent = [m.time - m.time[0] for m in motions]
    begin = np.concatenate([[0.0], np.cumsum([float(t[-1]) for t in spent])])
    clocks = [
        _smooth([m.common for m in motions]), _smooth([t / max(float(t[-1]), 1e-9) for t in spent]),
        _smooth([b + t for b, t in zip(begin, spent, strict=False)], _FINER),
    ]  # fmt: skip
    each = zip(motions, *clocks, strict=True)
    return {
        "time": [[np.ones_like(m.time), *(f for clock in own for f in clock)] for m, *own in each],
        "temperature": _smooth([m.temperature for m in motions]),
    }


def _of_direction(g: Ground) -> list[Floats]:
    """Functions (n,) of the feed direction in the plane of the workpiece."""
    speed = np.linalg.norm(g.velocity, axis=1)
    moving = speed > _MOVES * max(float(speed.max()), 1e-9)
    angle = np.arctan2(g.velocity[:, 1], g.velocity[:, 0])
    return [np.where(moving, f(k * angle), 0.0) for k in (1, 2) for f in (np.cos, np.sin)]


class _Store:
    """Collects functions of one kind in its unit, um or N; those that are zero in every run are dropped."""

    def __init__(self, kind: str, first: int, width: int, rows: Sequence[int]) -> None:
        self.kind, self.first, self.width, self.rows = kind, first, width, rows
        self.size = 1e-3 if kind in ("tip", "encoder") else 1.0
        self.labels: list[str] = []
        self.channels: list[int] = []
        self.columns: list[list[Floats]] = [[] for _ in rows]

    def put(self, label: str, channels: Iterable[int], functions: Functions) -> None:
        """Add every function, of every run, to each of the channels; of runs without any it is 0."""
        count = max(map(len, functions))
        full = [own or [np.zeros(n)] * count for own, n in zip(functions, self.rows, strict=True)]
        each = [
            per_run for per_run in zip(*full, strict=True) if any(np.abs(v).max(initial=0.0) >= 1e-12 for v in per_run)
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
    """All functions of the channels that were measured; unit size is 1 um or 1 N."""
    m, rows = len(actuators), [len(g.tip) for g in grounds]
    every = zip(KINDS, (0, 3, 3 + m, 3 + 2 * m), (3, m, m, 3), strict=True)
    stores = {
        kind: _Store(kind, first, width, rows) for kind, first, width in every if any(g.present[kind] for g in grounds)
    }
    for j, a in enumerate(actuators):
        for name, functions in _of_actuator(grounds, j).items():
            for kind in stores.keys() - {"dyno", "encoder" if name == "force" else ""}:
                # a displaced carriage moves the tip in any direction
                stores[kind].put(f"{name}:{a}", range(3) if kind == "tip" else (j,), functions)
    for name, functions in _of_time(grounds).items():
        for kind, store in stores.items():
            for channel, of in enumerate("xyz" if kind in ("tip", "dyno") else actuators):
                store.put(f"{name}:{of}", (channel,), functions)
    turns = [_of_direction(g) for g in grounds]
    for axis, name in enumerate("xyz"):
        loads = _smooth([g.force[:, axis] for g in grounds])
        for kind in stores.keys() & {"tip", "dyno"}:
            stores[kind].put(f"direction:{name}", (axis,), turns)
            stores[kind].put(f"force:{name}", range(3) if kind == "tip" else (axis,), loads)
        if "tip" in stores:
            places = _smooth([g.tip[:, axis] for g in grounds], _FINER, REPEATABILITY_MM)
            stores["tip"].put(f"position:{name}", range(3), places)
    return [store.done() for store in stores.values()]
