"""Functions of one covariate each on which a residual may depend: the dictionary of model/discrepancy for runs of programs.

An unknown effect is found by them, and they name the covariates that it depends on. A function moves a carriage (and so the
tip, in any direction), an encoder, a drive force, the tip itself, or the dynamometer.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from camcomp.diagnosis.fit.bench import Bench
from camcomp.diagnosis.fit.starts import STANDING_MM_PER_S
from camcomp.diagnosis.model.discrepancy import ORDERS, smooth_functions
from camcomp.diagnosis.model.noise import REPEATABILITY_MM
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion

_RELAX_MM = (0.5, 3.0)
KINDS = ("tip", "encoder", "drive", "dyno")
Functions = list[list[Floats]]  # (n,) per run and function


@dataclass(frozen=True, eq=False)
class Dictionary:
    """labels (p,): covariate; kinds (p,): of the channel that a function moves; blocks: per run (c n, p)."""

    labels: tuple[str, ...]
    kinds: tuple[str, ...]
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


def _of_actuator(motions: Sequence[Motion], drives: Sequence[Floats], j: int) -> dict[str, Functions]:
    """Functions of the motion and modelled force (n, m) of actuator j, by covariate."""
    rates = [np.gradient(m.speed[:, j], m.time) if m.ordered and len(m.time) > 2 else 0.0 * m.time for m in motions]
    return {
        "position": _smooth([m.encoder[:, j] for m in motions], 2 * ORDERS),
        "velocity": _smooth([m.speed[:, j] for m in motions]),
        "reversal": [[m.direction[:, j], *(_reversal(m, each, j) for each in _RELAX_MM)] for m in motions],
        "force": _smooth([drive[:, j] for drive in drives]),
        "acceleration": _smooth(rates),
    }


def _of_time(motions: Sequence[Motion]) -> dict[str, Functions]:
    """Functions of time (common clock, own time of a run, measured time one run after the other), and of temperature."""
    spent = [m.time - m.time[0] for m in motions]
    begin = np.concatenate([[0.0], np.cumsum([float(t[-1]) for t in spent])])
    clocks = [
        _smooth([m.common for m in motions]), _smooth([t / max(float(t[-1]), 1e-9) for t in spent]),
        _smooth([b + t for b, t in zip(begin, spent, strict=False)], 2 * ORDERS),
    ]  # fmt: skip
    each = zip(motions, *clocks, strict=True)
    return {
        "time": [[np.ones_like(m.time), *(f for clock in own for f in clock)] for m, *own in each],
        "temperature": _smooth([m.temperature for m in motions]),
    }


def _of_direction(velocity: Floats) -> list[Floats]:
    """Functions (n,) of the feed direction in the plane of the workpiece; velocity (n, 3) mm/s."""
    moving = np.linalg.norm(velocity, axis=1) > STANDING_MM_PER_S
    angle = np.arctan2(velocity[:, 1], velocity[:, 0])
    return [np.where(moving, f(k * angle), 0.0) for k in (1, 2) for f in (np.cos, np.sin)]


def dictionary(bench: Bench) -> Dictionary:
    """All functions of the channels that were measured, at the rows that are kept after thinning, without those that are zero in
    every run; unit size is 1 um or 1 N.
    """
    actuators = bench.actuators
    motions, drives, forces, tips, turns = zip(*(_covariates(bench, k) for k in range(len(bench.runs))), strict=True)
    rows = [len(tip) for tip in tips]
    kinds = [
        kind
        for kind in KINDS
        if any(run.measured.has(kind) and (kind != "encoder" or run.by == "setpoint") for run in bench.runs)
    ]
    found: list[tuple[str, str, int, tuple[Floats, ...]]] = []

    def put(kind: str, label: str, channels: Iterable[int], functions: Functions) -> None:
        """Add every function, of every run, to each of the channels of a kind; of runs without any it is 0."""
        count = max(map(len, functions))
        full = [own or [np.zeros(n)] * count for own, n in zip(functions, rows, strict=True)]
        each = [run for run in zip(*full, strict=True) if any(np.abs(v).max(initial=0.0) >= 1e-12 for v in run)]
        found.extend((kind, label, bench.parts[kind].start + channel, run) for run, channel in product(each, channels))

    for j, a in enumerate(actuators):
        for name, functions in _of_actuator(motions, drives, j).items():
            for kind in kinds:
                if kind != "dyno" and (kind, name) != ("encoder", "force"):
                    # a displaced carriage moves the tip in any direction
                    put(kind, f"{name}:{a}", range(3) if kind == "tip" else (j,), functions)
    for name, functions in _of_time(motions).items():
        for kind in kinds:
            for channel, of in enumerate("xyz" if kind in ("tip", "dyno") else actuators):
                put(kind, f"{name}:{of}", (channel,), functions)
    for axis, name in enumerate("xyz"):
        loads = _smooth([force[:, axis] for force in forces])
        for kind in [each for each in kinds if each in ("tip", "dyno")]:
            put(kind, f"direction:{name}", (axis,), list(turns))
            put(kind, f"force:{name}", range(3) if kind == "tip" else (axis,), loads)
        if "tip" in kinds:
            put(
                "tip",
                f"position:{name}",
                range(3),
                _smooth([tip[:, axis] for tip in tips], 2 * ORDERS, REPEATABILITY_MM),
            )
    on = np.array([channel for *_, channel, _ in found], int)
    mine = [np.flatnonzero(on == channel) for channel in range(bench.parts["dyno"].stop)]
    size = np.where(on < bench.parts["drive"].start, 1e-3, 1.0)
    blocks = []
    for run, n in enumerate(rows):
        each = np.stack([values[run] for *_, values in found], axis=1) * size if found else np.zeros((n, 0))
        blocks.append(ByChannel(len(found), tuple((own, each[:, own]) for own in mine)))
    return Dictionary(tuple(label for _, label, *_ in found), tuple(kind for kind, *_ in found), tuple(blocks))


def _covariates(bench: Bench, k: int) -> tuple[Motion, Floats, Floats, Floats, list[Floats]]:
    """Of run k at the rows (n,) that are kept after thinning: motion, modelled drive force (n, m), modelled force (n, 3), tip (n, 3) mm
    in the program frame, and functions of its direction.
    """
    run, reading = bench.runs[k], bench.nominal[k]
    path, tip = run.run_path, reading.tip
    keep = np.arange(len(path.time) // run.thin) * run.thin + run.thin // 2
    velocity = np.gradient(tip, path.time, axis=0) if path.ordered and len(tip) > 2 else np.zeros_like(tip)
    return reading.motion.at(keep), reading.drive[keep], reading.dyno[keep], tip[keep], _of_direction(velocity[keep])
