"""Division of the motions of a path into pieces with one kind of load."""

from __future__ import annotations

import numpy as np

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, RAPID, Bools, Floats, Ints, Path
from camcomp.model.cutting.engaged import Engaged
from camcomp.model.cutting.upright import Verticals

Pieces = tuple[Ints, Floats, Floats, Bools]  # motion, u0, u1, whether the piece begins at the vertical


def whole_motions(path: Path) -> Pieces:
    """Every motion as one piece."""
    n = len(path)
    return np.arange(n), np.zeros(n), np.ones(n), np.zeros(n, np.bool_)


def divide_motions(path: Path, top_mm: float | None, upright: Verticals, engaged: Engaged | None) -> Pieces:
    """Motions, divided where a feed motion crosses the stock's top or an arc passes the vertical.

    With a known stock they are divided at the places of its engagement instead of at its top.

    Returns:
        Motion (p,), fractions u0 and u1 (p,), and mask (p,) of the pieces that begin at the vertical.
    """
    whole = whole_motions(path)
    over = upright.overturns(path)
    cuts = {*over, *(_crossings(path, top_mm) if engaged is None else _inner(engaged))}
    if not cuts:
        return whole
    motion = np.concatenate((whole[0], [i for i, _ in cuts]))
    u0 = np.concatenate((whole[1], [at for _, at in cuts]))
    order = np.lexsort((u0, motion))
    motion, u0 = motion[order], u0[order]
    u1 = np.ones(len(u0))
    same = motion[1:] == motion[:-1]
    u1[:-1][same] = u0[1:][same]
    turned = np.zeros(len(motion), np.bool_)
    for i, at in over:
        turned |= (motion == i) & (u0 == at)
    return motion, u0, u1, turned


def _inner(engaged: Engaged) -> list[tuple[int, float]]:
    """Places of the engagement between the ends of motions."""
    inner = (engaged.u > 0.0) & (engaged.u < 1.0)
    return list(zip(engaged.motion[inner].tolist(), engaged.u[inner].tolist(), strict=True))


def _crossings(path: Path, top: float | None) -> list[tuple[int, float]]:
    """Feed motions and fractions at which they cross the stock's top."""
    if top is None:
        return []
    u = np.linspace(0.0, 1.0, 65)
    moves = np.flatnonzero((path.kind != RAPID) & path.known & ~path.machine)
    below = (path.start[moves, 2] < top, path.end[moves, 2] < top)
    flat = np.abs(path.axis[moves, 2]) == 1.0  # an arc in the XY plane climbs steadily, if at all
    crossing = moves[(below[0] != below[1]) | ((path.kind[moves] == ARC) & ~flat)]
    cuts: list[tuple[int, float]] = []
    for i in crossing:
        row = np.full(len(u), i)
        height = path_geometry.points(path, row, u)[:, 2] - top
        for k in np.flatnonzero((height[:-1] < 0.0) != (height[1:] < 0.0)):
            cuts.append((int(i), _crossing(path, int(i), u[k], u[k + 1], top)))
    return [(i, at) for i, at in cuts if 1e-9 < at < 1.0 - 1e-9]


def _crossing(path: Path, motion: int, a: float, b: float, height: float) -> float:
    """Fraction of a motion at which it passes a height (mm), by bisection."""
    row = np.array([motion])
    below = path_geometry.points(path, row, np.array([a]))[0, 2] < height
    for _ in range(60):
        middle = 0.5 * (a + b)
        if (path_geometry.points(path, row, np.array([middle]))[0, 2] < height) == below:
            a = middle
        else:
            b = middle
    return 0.5 * (a + b)
