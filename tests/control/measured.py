"""Where a recorded motion passes the points of a program: the nearest place, in the order of travel."""

from __future__ import annotations

import numpy as np

BEFORE, BEHIND = 1.5, 0.6  # mm along the way around the place where a point is expected
SAME = 1e-4  # mm by which one place is no nearer than another
CORNER = 0.2  # of the way between two points that the corners may have cut off


def passes(tip: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Nearest places (k, 3) mm of a recorded tip (n, 3) to points (k, 3) mm that it passes one after the other.

    The points are all end points of a program from its first move on, and may have others between them.
    """
    step = np.linalg.norm(np.diff(tip, axis=0), axis=1)
    way = np.concatenate(([0.0], np.cumsum(step)))
    out = np.empty_like(points)
    at, last = 0.0, tip[0]
    for i, point in enumerate(points):
        gap = float(np.linalg.norm(point - last))
        low, high = at + (1.0 - CORNER) * gap - BEFORE, at + gap + BEHIND
        a = max(int(np.searchsorted(way, max(low, at))) - 1, 0)
        b = min(int(np.searchsorted(way, high)) + 1, len(tip) - 1)
        begin, along = tip[a:b], tip[a + 1 : b + 1] - tip[a:b]
        square = np.maximum(np.sum(along**2, axis=1), 1e-30)
        share = np.clip(np.sum((point - begin) * along, axis=1) / square, 0.0, 1.0)
        places = begin + share[:, None] * along
        beside = np.linalg.norm(places - point, axis=1)
        # the first of those that are as near: behind a turn on the spot the way comes by again
        nearest = (beside <= np.append(beside[1:], np.inf)) & (beside < beside.min() + SAME)
        best = int(np.argmax(nearest))
        out[i] = places[best]
        at, last = float(way[a + best] + share[best] * np.sqrt(square[best])), point
    return out
