"""The formulas of ISO 230-2:2014, 3.11 to 3.25, of ISO 230-4:2022, 3.3 to 3.5, and of ISO 9283:1998, 7.2: lengths in, values in the same unit out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from camcomp.ground.datatypes import Floats


def positioning(forward: Sequence[Floats], backward: Sequence[Floats]) -> dict[str, float]:
    """Values of deviations (measured minus commanded) by target, of two approaches or more from either side: accuracy A,
    repeatability R and systematic deviation E of both and of either direction, reversal B, range of the means M.

    R is the largest of the targets' R_i = max(2 s_forward + 2 s_backward + |B_i|, 4 s_forward, 4 s_backward).
    """
    up, down = (np.array([np.mean(each) for each in way]) for way in (forward, backward))
    s_up, s_down = (np.array([np.std(each, ddof=1) for each in way]) for way in (forward, backward))
    reversal = up - down
    both = np.max([2.0 * s_up + 2.0 * s_down + np.abs(reversal), 4.0 * s_up, 4.0 * s_down], axis=0)
    tops, bottoms = (np.stack([up + k * s_up, down + k * s_down]) for k in (2.0, -2.0))
    means = np.stack([up, down])
    return {
        "A": float(tops.max() - bottoms.min()), "A_forward": float(tops[0].max() - bottoms[0].min()),
        "A_backward": float(tops[1].max() - bottoms[1].min()), "R": float(both.max()), "R_forward": float(4.0 * s_up.max()),
        "R_backward": float(4.0 * s_down.max()), "B": float(np.abs(reversal).max()), "B_mean": float(reversal.mean()),
        "E": float(np.ptp(means)), "E_forward": float(np.ptp(up)), "E_backward": float(np.ptp(down)),
        "M": float(np.ptp(means.mean(axis=0))),
    }  # fmt: skip


def circular_deviation(points: Sequence[Floats]) -> float:
    """Range of the radii of points (n, 2) about the centre of their least-squares circle (G, G(b))."""
    all_points = np.concatenate(points)
    known = all_points[np.isfinite(all_points).all(axis=1)]

    def off(centre: Floats) -> Floats:
        radius = np.hypot(*(known - centre).T)
        return np.asarray(radius - radius.mean())

    return float(np.ptp(least_squares(off, known.mean(axis=0), ftol=None, xtol=1e-12).fun))


def pose_accuracy(off: Floats) -> float:
    """Distance of the barycentre of attained positions from the commanded one; off (n, 3): attained minus commanded."""
    return float(np.linalg.norm(off.mean(axis=0)))


def pose_repeatability(attained: Floats) -> float:
    """Radius of the sphere about the barycentre of positions (n, 3): mean distance from it and three of its deviations."""
    distance = np.linalg.norm(attained - attained.mean(axis=0), axis=1)
    return float(distance.mean() + 3.0 * distance.std(ddof=1))
