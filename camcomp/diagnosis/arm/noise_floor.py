"""How far the measured tip of a standing arm scatters by itself: from poses taken again, or as the instrument states it.

What a fitted model leaves is no such measure: it holds whatever the model lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.spatial import KDTree
from scipy.stats import chi2

from camcomp.diagnosis.arm.poses import Poses
from camcomp.diagnosis.model.discrepancy import ORDERS, smooth_functions
from camcomp.diagnosis.model.noise import (
    FAR_OFF,
    IN_A_ROW,
    LEAST_VALUES,
    MANY,
    StatedDeviation,
    resolution_of,
    rounding_noise,
)
from camcomp.ground.datatypes import Floats
from camcomp.model.statics.description import Robot

REPEATS = ORDERS + LEAST_VALUES  # poses visited again, from which on a deviation is known beside a drift
SAME_POSE = 1e-3  # rad or m between two visits of one pose; the model turns the rest of the way into mm


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


def resolution(tip: Floats) -> float:
    """Step, mm, to which tips (n, 3) are rounded: the coarsest of the three axes, 0 where none shows."""
    return max(resolution_of(axis) for axis in tip.T)


def tip_floor(
    robot: Robot, campaigns: Sequence[Poses], gaps: Sequence[Floats], stated: StatedDeviation, *, least: bool = False
) -> TipFloor | None:
    """The floor of campaigns with gaps (n, 3) mm to a model; None where neither a statement nor repeats determine it.

    It is the larger of the stated floor and the scatter of repeats about slow waves in time: repeats do not show an
    error of the instrument's frame, and they may contradict a statement. The rounding of the recorded positions, which
    repeats do not show, is added. least: a lower bound, the stated floor, else the scatter of the quieter half of repeats.
    """
    both = _stated(robot, campaigns, stated), _repeated(robot, campaigns, gaps, quiet=least)
    known = [each for each in both if each]
    if not known:
        return None
    found = known[0] if least else max(known, key=lambda each: each.sd)
    rounding = rounding_noise(max(resolution(each.tip) for each in campaigns))
    return replace(found, sd=float(np.hypot(found.sd, rounding)))


def far_off(size: Floats, time: Floats) -> np.ndarray:
    """Which distances (n,) at times (n,) are no noise: a mask (n,), empty where too many are so far off to be single mistakes.

    IN_A_ROW of them one after the other are no mistakes either.
    """
    far = size > _most(size)
    if far.sum() > np.ceil(MANY * len(far)):  # one of a few poses may be a mistake as well
        return np.zeros(len(size), bool)
    order = np.argsort(time, kind="stable")
    for run in np.split(order, np.flatnonzero(np.diff(far[order].astype(int))) + 1):
        if len(run) >= IN_A_ROW:
            far[run] = False
    return far


def _most(size: Floats) -> float:
    """FAR_OFF robust deviations of a coordinate, from distances (n,) in space."""
    return FAR_OFF * max(float(np.median(size) / np.sqrt(chi2.median(3))), 1e-6)


def _stated(robot: Robot, campaigns: Sequence[Poses], stated: StatedDeviation) -> TipFloor | None:
    """Columns of deviations where there are any, the experiment's where it states more; every pose has to have one."""
    slides = sum(not a.revolute for a in robot.actuators)  # lengths do not apply to a hinge's encoder
    squares = []
    for each in campaigns:
        own = np.full((len(each.q), 3), np.nan) if each.sd is None else each.sd
        every = np.fmax(own, np.nan if stated.tip_mm is None else stated.tip_mm)
        squares.append(every**2 + slides / 3.0 * (stated.encoder_mm or 0.0) ** 2)
    whole = np.concatenate(squares)
    return TipFloor(float(np.sqrt(whole.mean())), np.inf, "stated") if np.isfinite(whole).all() else None


def _repeated(robot: Robot, campaigns: Sequence[Poses], gaps: Sequence[Floats], quiet: bool) -> TipFloor | None:
    """From poses visited again, else from tips read again while the arm stood. quiet: from their median."""
    anew: list[tuple[float, float]] = []
    still: list[tuple[float, float]] = []
    for each, gap in zip(campaigns, gaps, strict=True):
        order = np.empty(len(each.q), int)
        order[np.argsort(each.time, kind="stable")] = np.arange(len(each.q))
        visits = _near(visits_of(robot, each), gap)
        again = [rows for rows in visits if np.ptp(order[rows]) > len(rows) - 1]
        anew += _minus_drift(again, gap, order)
        stood = [rows for rows in visits if np.ptp(order[rows]) == len(rows) - 1]
        still += [(_square(gap[rows]), len(rows) - 1.0) for rows in stood]
    return _scatter(anew, "repeats", quiet) or _scatter(still, "rest", quiet)


def _near(visits: Sequence[np.ndarray], gap: Floats) -> list[np.ndarray]:
    """Visits whose gaps (n, 3) scatter by no more than noise does."""
    size = np.array([np.sqrt(_square(gap[rows]) / (len(rows) - 1)) for rows in visits])
    return [rows for rows, own in zip(visits, size, strict=True) if own <= _most(size)]


def _square(values: Floats) -> float:
    return float(((values - values.mean(axis=0)) ** 2).sum())


def _minus_drift(visits: Sequence[np.ndarray], gap: Floats, order: np.ndarray) -> list[tuple[float, float]]:
    """(Sum of squares, degrees of freedom) of gaps (n, 3) within visits of one pose, with slow waves of all rows in
    time removed.
    """
    more = sum(len(rows) - 1 for rows in visits)
    if more < REPEATS:
        return [(_square(gap[rows]), len(rows) - 1.0) for rows in visits]
    waves = smooth_functions(order + 0.5, 0.0, len(order))
    left = np.concatenate([gap[rows] - gap[rows].mean(axis=0) for rows in visits])
    basis = np.concatenate([waves[rows] - waves[rows].mean(axis=0) for rows in visits])
    left = left - basis @ np.linalg.lstsq(basis, left, rcond=1e-9)[0]
    parts = np.split(left, np.cumsum([len(rows) for rows in visits])[:-1])
    share = 1.0 - ORDERS / more  # of the freedom is left
    return [(float((each**2).sum()), share * (len(each) - 1)) for each in parts]


def _scatter(groups: Sequence[tuple[float, float]], source: Literal["repeats", "rest"], quiet: bool) -> TipFloor | None:
    if sum(more for _, more in groups) < LEAST_VALUES:
        return None
    square, more = np.array(groups).T
    freedom = 3.0 * float(more.sum())
    sd = float(np.sqrt(square.sum() / freedom))
    if quiet:
        sd = min(sd, float(np.sqrt(np.median(square / chi2.median(3.0 * more)))))
    return TipFloor(sd, freedom, source)


def visits_of(robot: Robot, poses: Poses) -> list[np.ndarray]:
    """Groups of indices of poses at the same joint coordinates, two or more each."""
    scale = np.array([1.0 if a.revolute else 1e-3 for a in robot.actuators])
    near = KDTree(poses.q * scale).query_pairs(SAME_POSE, output_type="ndarray")
    group = np.arange(len(poses.q))
    for i, j in near[np.lexsort((near[:, 1], near[:, 0]))]:
        group[j] = group[i]
    names, count = np.unique(group, return_counts=True)
    return [np.flatnonzero(group == name) for name in names[count > 1]]
