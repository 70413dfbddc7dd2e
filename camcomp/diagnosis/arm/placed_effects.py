"""What can be the cause at one place of an arm: an effect at a target, with its columns and the ways in which it may act.

Groups of a whole effect at all joints are for arms that are off everywhere (`forward_selection`); these are for arms of
which a few things are wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from camcomp.diagnosis.arm.discrepancy import ResidualBlock
from camcomp.diagnosis.arm.poses import CURVE, ArmBench, Column, Poses, complete, wave_motion
from camcomp.ground.datatypes import Floats
from camcomp.model import signal_path
from camcomp.model.effect import Motion

HARMONICS = (2, 4, 40)  # waves of a curve, in as many ways
Place = tuple[str, str | None]


@dataclass(frozen=True)
class PlacedEffect:
    """An effect at a target. columns: indices; ways: how many there are for this effect at this target, or windows of time."""

    effect: str
    target: str | None
    columns: tuple[int, ...]
    ways: float = 1.0

    @property
    def place(self) -> Place:
        """Effect and target."""
        return self.effect, self.target


def placed_effects(columns: Sequence[Column]) -> list[PlacedEffect]:
    """Every effect at every target, once for each shape that it may have."""
    own: dict[tuple[Place, tuple[Any, ...]], list[int]] = {}
    for j, column in enumerate(columns):
        own.setdefault(((column.effect, column.target), column.shape), []).append(j)
    shapes: dict[Place, int] = {}
    for place, _ in own:
        shapes[place] = shapes.get(place, 0) + 1
    out: list[PlacedEffect] = []
    for (place, _), each in own.items():
        if place[0] != CURVE:
            out.append(PlacedEffect(*place, tuple(each), float(shapes[place])))
            continue
        for most in HARMONICS:
            own_waves = tuple(j for j in each if _order(columns[j]) <= most)
            out.append(PlacedEffect(*place, own_waves, float(len(HARMONICS))))
    return out


def _order(column: Column) -> int:
    """How often a wave of a joint repeats per turn."""
    return int(column.parameter.name.split("_")[1])


def extended(
    bench: ArmBench, blocks: Sequence[ResidualBlock], joints: Sequence[Floats], columns: Sequence[Column]
) -> list[ResidualBlock]:
    """Blocks with the motion by more columns of drives behind those they have. joints (n, 3, m): motion per rad (mm) of each."""
    out = []
    waves = [j for j, column in enumerate(columns) if column.effect == CURVE]
    for b, poses, moved in zip(blocks, bench.campaigns, joints, strict=True):
        own = np.empty((*b.r.shape, len(columns)))
        own[:, :, waves] = wave_motion(moved, bench.actuators, poses.q, [columns[j] for j in waves])
        for j in sorted(set(range(len(columns))) - set(waves)):
            own[:, :, j] = drive_motion(bench, poses, moved, columns[j])
        out.append(replace(b, X=np.concatenate([b.X, own], axis=2)))
    return out


def drive_motion(bench: ArmBench, poses: Poses, joints: Floats, column: Column) -> Floats:
    """Motion (n, 3) of tips, per scale, by what a column does to drives. joints (n, 3, m): motion per rad (mm) of every joint."""
    zero, home = np.zeros_like(poses.q), np.array([a.home for a in bench.robot.actuators])
    way = zero if poses.approach is None else poses.approach
    still = np.zeros(len(poses.q))
    stiff = signal_path.springs(bench.robot)
    motion = Motion(poses.time, poses.time, still, poses.temperature, poses.q, zero, way, home, stiff, False)
    cause = column.cause(1.0)
    error, _ = signal_path.driven([replace(cause, values=complete(cause))], bench.actuators, motion)
    return np.asarray(np.einsum("nim,nm->ni", joints, error), float)
