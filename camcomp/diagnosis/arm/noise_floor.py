"""How far the measured tip of a standing arm scatters by itself: from poses taken again, or as the instrument states it.

What a fitted model leaves is no such measure: it holds whatever the model lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial import KDTree

from camcomp.diagnosis.arm.poses import Poses
from camcomp.ground.datatypes import Floats
from camcomp.model.statics.description import Robot

SAME_POSE = 1e-3  # rad or m between two visits of one pose; the model turns the rest of the way into mm
LEAST_VISITS = 10  # beyond the first ones; fewer know a deviation to no better than a fifth
FAR = 8.0  # medians: no noise reaches so far, beams that were cut do
MOST_FAR = 0.03  # of the poses; where more are far off, something acts there


@dataclass(frozen=True)
class TipFloor:
    """Deviation of one coordinate of the tip, mm, by how many numbers it is known (infinite: stated), and its source."""

    sd: float
    freedom: float
    source: Literal["repeats", "rest", "stated"]

    @property
    def um(self) -> float:
        """Root mean square of the distance, um."""
        return 1e3 * float(np.sqrt(3.0)) * self.sd


@dataclass(frozen=True)
class StatedDeviation:
    """What an experiment states of its instruments, mm per axis; None where it says nothing."""

    tip: float | None = None
    encoder: float | None = None


def tip_floor(
    robot: Robot, campaigns: Sequence[Poses], gaps: Sequence[Floats], stated: StatedDeviation
) -> TipFloor | None:
    """The floor of campaigns with gaps (n, 3) mm to their nominal model; None where nothing tells it.

    The larger of what is stated and of what repeats show: drift and frame of an instrument do not show in repeats, and a
    statement that repeats belie is none.
    """
    known = [each for each in (_stated(robot, campaigns, stated), _repeated(robot, campaigns, gaps)) if each]
    return max(known, key=lambda each: each.sd, default=None)


def far_off(size: Floats) -> np.ndarray:
    """Which distances (n,) are no noise: a mask (n,), empty where too many are so far off to be single mistakes."""
    far = size > FAR * max(float(np.median(size)), 1e-6)
    return far if far.mean() <= MOST_FAR else np.zeros(len(size), bool)


def _stated(robot: Robot, campaigns: Sequence[Poses], stated: StatedDeviation) -> TipFloor | None:
    """Columns of deviations where there are any, the experiment's where it states more; every pose has to have one."""
    slides = sum(not a.revolute for a in robot.actuators)  # a length says nothing of a hinge's encoder
    squares = []
    for each in campaigns:
        own = np.full((len(each.q), 3), np.nan) if each.sd is None else each.sd
        every = np.fmax(own, np.nan if stated.tip is None else stated.tip)
        squares.append(every**2 + slides / 3.0 * (stated.encoder or 0.0) ** 2)
    whole = np.concatenate(squares)
    return TipFloor(float(np.sqrt(whole.mean())), np.inf, "stated") if np.isfinite(whole).all() else None


def _repeated(robot: Robot, campaigns: Sequence[Poses], gaps: Sequence[Floats]) -> TipFloor | None:
    """From poses visited again, else from tips read again while the arm stood."""
    anew: list[tuple[float, int]] = []
    still: list[tuple[float, int]] = []
    for each, gap in zip(campaigns, gaps, strict=True):
        order = np.empty(len(each.q), int)
        order[np.argsort(each.time, kind="stable")] = np.arange(len(each.q))
        for visits in visits_of(robot, each):
            square = float(((gap[visits] - gap[visits].mean(axis=0)) ** 2).sum())
            stood = np.ptp(order[visits]) == len(visits) - 1
            (still if stood else anew).append((square, len(visits) - 1))
    return _scatter(anew, "repeats") or _scatter(still, "rest")


def _scatter(groups: Sequence[tuple[float, int]], source: Literal["repeats", "rest"]) -> TipFloor | None:
    if sum(more for _, more in groups) < LEAST_VISITS:
        return None
    square, more = np.array(groups).T
    size = np.sqrt(square / more)
    near = size <= FAR * max(float(np.median(size)), 1e-6)
    freedom = 3.0 * float(more[near].sum())
    sd = float(np.sqrt(square[near].sum() / freedom))
    return TipFloor(sd, freedom, source) if sd > 0.0 else None


def visits_of(robot: Robot, poses: Poses) -> list[np.ndarray]:
    """Groups of indices of poses at the same joint coordinates, two or more each."""
    scale = np.array([1.0 if a.revolute else 1e-3 for a in robot.actuators])
    near = KDTree(poses.q * scale).query_pairs(SAME_POSE, output_type="ndarray")
    group = np.arange(len(poses.q))
    for i, j in near[np.lexsort((near[:, 1], near[:, 0]))]:
        group[j] = group[i]
    names, count = np.unique(group, return_counts=True)
    return [np.flatnonzero(group == name) for name in names[count > 1]]
