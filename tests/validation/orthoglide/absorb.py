"""How much of an effect other causes can imitate, by the truth machine's own sensitivities.

An experiment whose effect lies in the span of the library cannot be called unknown by anyone; such cases are counted apart.
Columns are the changes of every present channel, over its noise, per unit of each library cause.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from tests.validation.plants.causes import AXES, Cause, every_cause
from tests.validation.plants.experiments import CHANNELS, Plan, even, executed, middle, observe_all
from tests.validation.plants.machine import State, Truth

COUNT = 40  # samples per run


def _stack(states: list[State], plan: Plan) -> np.ndarray:
    present, noise = CHANNELS[plan.channels], plan.noise
    parts = []
    for s in states:
        if "tip" in present:
            parts.append(s.tip / noise.tip)
        if "act" in present:
            parts.append((s.encoder - s.setpoint) / noise.encoder)
        if "drive" in present:
            parts.append(s.drive / noise.drive)
        if "dyno" in present:
            parts.append(s.force / noise.dyno)
    return np.concatenate([p.reshape(-1) for p in parts])


def _members() -> list[tuple[str, list[Truth]]]:
    """(effect, truths that span it) of every library cause, each of a fair size."""
    groups: list[tuple[str, list[Truth]]] = []
    for effect, target in every_cause():
        if effect == "workpiece_frame":
            shifts = [Truth(shift_mm=0.01 * row) for row in np.eye(3)]
            groups.append((effect, [*shifts, Truth(rotation_deg=0.02)]))
        elif effect == "screw_cyclic":
            which = np.array([a == target for a in AXES], float)
            for pitch in (4.0, 5.0, 6.0, 8.0, 10.0):
                both = [
                    Truth(
                        cyclic_mm=0.01 * which,
                        cyclic_pitch_mm=np.full(3, pitch),
                        cyclic_phase=np.full(3, phase),
                    )
                    for phase in (0.0, np.pi / 2)
                ]
                groups.append((effect, both))
        else:
            cause = Cause(effect, target, 100)
            groups.append((effect, [cause.put(Truth(), cause.unit(), (0.0, 0.0))[0]]))
    return groups


@lru_cache(maxsize=64)
def _library(world: int, design: str, channels: str) -> tuple[list[tuple[str, np.ndarray]], list]:
    """(effect, its columns (rows, k)) of every library cause that shows, and the inputs of further simulations."""
    plan = Plan(seed=world, design=design, channels=channels, world=world)
    _, runs = executed(plan)
    times = [even(r, COUNT) for r in runs]
    clean = _stack(observe_all(runs, Truth(), times), plan)
    groups = []
    for effect, truths in _members():
        columns = np.stack([_stack(observe_all(runs, t, times), plan) - clean for t in truths], 1)
        size = np.linalg.norm(columns, axis=0)
        if (size > 1e-9).any():
            groups.append((effect, columns[:, size > 1e-9] / size[size > 1e-9]))
    return groups, [runs, times, clean, plan]


def left(cause: Cause, plan: Plan, without: tuple[str, ...], picks: int = 3) -> float:
    """Share (0..1, amplitude) of an effect that remains when up to `picks` other causes imitate it."""
    assert plan.world is not None
    groups, (runs, times, clean, base) = _library(plan.world, plan.design, plan.channels)
    truth, _ = cause.put(Truth(), cause.sign() * cause.unit(), middle(runs))
    want = _stack(observe_all(runs, truth, times), base) - clean
    total = float(np.linalg.norm(want))
    if total == 0.0:
        return 0.0
    usable = [columns for effect, columns in groups if effect not in without]
    basis, rest = np.zeros((len(want), 0)), want
    for _ in range(picks):
        tries = [np.concatenate([basis, columns], 1) for columns in usable]
        rests = [want - b @ np.linalg.lstsq(b, want, rcond=None)[0] for b in tries]
        best = min(range(len(tries)), key=lambda i: float(np.linalg.norm(rests[i])))
        basis, rest = tries[best], rests[best]
    return float(np.linalg.norm(rest) / total)
