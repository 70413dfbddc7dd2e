"""Milling forces for the truth plants: a slot cut tooth by tooth, its forces summed over a turn.

The spindle turns either way; the cutter for M4 is the mirror image of the one for M3. Forces are those on the tool, right of
the feed, along it and along the tool axis.
"""

from collections.abc import Callable

import numpy as np

STEPS = 20_000  # positions of a tooth in half a turn

Edge = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]


def linear(tangential, radial, axial, edge=(0.0, 0.0, 0.0)) -> Edge:
    """Forces per mm of edge at chips h (k,) mm: against the tooth's motion, towards the tool's centre, down the tool."""
    return lambda h: (tangential * h + edge[0], radial * h + edge[1], axial * h + edge[2])


def power(kc11: float, mc: float, radial: float, axial: float) -> Edge:
    """The same by Kienzle's law and two ratios."""
    return lambda h: tuple(ratio * kc11 * h ** (1.0 - mc) for ratio in (1.0, radial, axial))  # type: ignore[return-value]


def slot(edge: Edge, *, feed: float, speed: float, sense: float, depth: float, teeth: int) -> np.ndarray:
    """Mean force (3,) N: right of the feed (mm/min), along it, along the axis. sense: +1 by M3, -1 by M4; speed in rev/min."""
    phi = (np.arange(STEPS) + 0.5) * np.pi / STEPS  # from the side where the tooth enters to the other
    tangential, radial, axial = edge(feed / (teeth * speed) * np.sin(phi))
    # M3, seen from above: the tooth comes in on the left, moves forwards and to the right, and leaves on the right.
    along = np.mean(-tangential * np.cos(phi) - radial * np.sin(phi))
    left = np.mean(tangential * np.sin(phi) - radial * np.cos(phi))
    return 0.5 * teeth * depth * np.array([-sense * left, along, -np.mean(axial)])
