"""How the engagement of ball and bull-nose tools depends on the cell, against the closed form of a ridge between two grooves.

The grooves are chords of a hundredth of a millimetre, so that no node knows most of them, turned and shifted against the
grid; the tool stands on the ridge. Cells are halved three times.
"""

import numpy as np
import pytest

from camcomp.model.stock.front import EDGE, FLOOR
from camcomp.model.stock.memory import NO_TOOL, StockMemory
from camcomp.model.stock.shapes import StockShape, ToolShape
from camcomp.model.stock.slices import SLICES
from tests.paths import path_of

R, Z, LONG, CHORDS, WIDE = 2.0, -2.5, 3.0, 500, 5  # slices from below whose arcs are wider than any cell
CELLS = np.array([0.4, 0.2, 0.1, 0.05])
CORNER, APART = {"ball": R, "bull": 1.2}, {"ball": 1.4, "bull": 1.5}
PLACED = [(0.3, (0.13, -0.42)), (1.1, (-0.31, 0.27)), (2.0, (0.44, 0.06))]  # direction in rad, shift in mm
BLOCK = StockShape(np.array([-8.0, -8.0, -3.0]), np.array([8.0, 8.0, 0.0]))


def reach(kind, lift):
    """Radius of the tool at a height over its tip."""
    corner = CORNER[kind]
    return R - corner + np.sqrt(np.maximum(corner**2 - (corner - np.minimum(lift, corner)) ** 2, 0.0))


def ridge(kind):
    """Its height over the tip."""
    corner = CORNER[kind]
    return corner - np.sqrt(corner**2 - max(APART[kind] - R + corner, 0.0) ** 2)


def errors(kind, cell, turn, shift):
    """Mean of the largest error of an angle (rad), mean error of the engaged area (of it) and of the depth (mm)."""
    e = np.array([np.cos(turn), np.sin(turn)])
    memory = StockMemory(BLOCK, {NO_TOOL: ToolShape(kind, 2.0 * R, CORNER[kind])}, cell)
    for side in (1.0, -1.0):
        way = np.linspace(-LONG, LONG, CHORDS + 1)[:, None] * e + shift + side * APART[kind] * np.array([-e[1], e[0]])
        moves = [("line", (x, y, Z)) for x, y in way[1:]]
        memory.follow(path_of(*moves, ("rapid", (*way[-1], 5.0)), start=(*way[0], Z)))
    found = []
    for s in np.linspace(-1.5, 1.5, 40):
        depth, arcs = memory.meet(np.append(shift + s * e, Z), np.append(e, 0.0), NO_TOOL)
        ends = 0.5 * depth * (1.0 - np.cos(np.pi * np.arange(SLICES + 1) / SLICES))
        lift, tall = (0.5 * (ends[1:] + ends[:-1]))[:WIDE], np.diff(ends)[:WIDE]
        np.testing.assert_allclose(arcs.height[:WIDE], tall, rtol=1e-9)  # one arc to a slice
        half, radius = APART[kind] - reach(kind, lift + FLOOR), reach(kind, lift) - EDGE
        wanted = np.where(half >= radius, np.pi, 2.0 * np.arcsin(np.clip(half / radius, 0.0, 1.0)))
        off = (arcs.stop - arcs.start)[:WIDE] - wanted
        found.append((np.abs(off).max(), abs(tall @ off) / (tall @ wanted), abs(depth + FLOOR - ridge(kind))))
    return np.mean(found, axis=0)


@pytest.mark.parametrize("kind", CORNER)
def test_engagement_on_a_ridge_comes_nearer_with_the_cell(kind):
    """Angles and area in the first order or better, on average over placements; the depth within 2 um in any cell."""
    made = np.array([[errors(kind, cell, turn, np.array(shift)) for turn, shift in PLACED] for cell in CELLS])
    angle, area, depth = made.mean(axis=1).T
    for each in (angle, area):
        order = np.polyfit(np.log(CELLS), np.log(each), 1)[0]
        assert order > 1.0 and each[-1] < each[0] * CELLS[-1] / CELLS[0], each
    assert angle[-1] < np.radians(0.05)
    assert depth.max() < 2e-3, depth
