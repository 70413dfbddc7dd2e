"""The engagement against exact solids: a block minus the swept tools of all earlier moves, made by another library."""

import numpy as np
import pytest

from camcomp.model.stock.front import EDGE, FLOOR
from camcomp.model.stock.memory import NO_TOOL, StockMemory, cell_for
from camcomp.model.stock.shapes import StockShape, ToolShape
from camcomp.model.stock.slices import SLICES
from tests.paths import path_of

manifold3d = pytest.importorskip("manifold3d", reason="the solids are made by manifold3d, part of camcomp[dev]")

R, TALL = 4.0, 30.0
AROUND, OVER = 160, 40  # facets around the tool, and over its corner, shorter towards the tip
BESIDE, DEEP = 0.25, 5e-3  # mm
LOW, HIGH = np.array([-25.0, -25.0, -10.0]), np.array([25.0, 25.0, 0.0])
LEVEL = [
    ("line", (12, -3, -3.0)), ("line", (14, 9, -3.0)), ("line", (-9, 11, -3.0)), ("line", (-13, -9, -3.0)),
    ("line", (-13, -9, -5.0)), ("line", (9, -12, -5.0)), ("line", (2, 3, -5.0)), ("line", (-16, 2, -5.0)),
]  # fmt: skip
RAMPS = [
    ("line", (12, -3, -4.0)), ("line", (14, 4, -2.5)), ("line", (-9, 6, -4.5)), ("line", (-11, -3, -3.0)),
    ("line", (9, -5, -4.2)), ("line", (4, 5, -5.0)), ("line", (-12, 1, -4.0)),
]  # fmt: skip
TURNS = np.arange(1, 13) * 2.0 * np.pi / 10.0
HELIX = [("line", (5 * np.cos(a), 5 * np.sin(a), -2.0 - 1.2 * a / (2.0 * np.pi))) for a in TURNS]
START = (-15.0, -4.0, -3.0)
CORNER = {"flat": 0.0, "ball": R, "bull": 1.5}


def tool_at(kind, tip):
    """A tool with facets that lie half a sagitta outside and half inside of it."""
    corner = CORNER[kind]
    out = 1.0 + 0.25 * (np.pi / AROUND) ** 2
    turn = 0.5 * np.pi * np.linspace(0.0, 1.0, OVER + 1) ** 1.4
    larger = corner * (1.0 + np.gradient(turn) ** 2 / 16.0)
    rim = (
        [(R - corner + r * np.sin(a), corner - r * np.cos(a)) for a, r in zip(turn, larger, strict=True)]
        if corner
        else [(R, 0.0)]
    )
    side = manifold3d.CrossSection([[(0.0, rim[0][1]), *((out * x, y) for x, y in rim), (out * R, TALL), (0.0, TALL)]])
    return manifold3d.Manifold.revolve(side, AROUND).translate(list(map(float, tip)))


def inside(polygons, points):
    """Which points (n, 2) lie in polygons, by the number of edges to their right."""
    odd = np.zeros(len(points), bool)
    (left, low), high = points.min(axis=0), points[:, 1].max()
    for polygon in polygons:
        a, b = polygon, np.roll(polygon, -1, axis=0)
        near = (np.maximum(a, b) >= (left, low)).all(axis=1) & (np.minimum(a[:, 1], b[:, 1]) <= high)
        for (xa, ya), (xb, yb) in zip(a[near], b[near], strict=True):
            crosses = (ya > points[:, 1]) != (yb > points[:, 1])
            x = xa + (points[:, 1] - ya) / (yb - ya if yb != ya else 1.0) * (xb - xa)
            odd ^= crosses & (points[:, 0] < x)
    return odd


def radius_of(kind, lift):
    """Radius of the tool over its tip, and by how much it grows per height."""
    corner = CORNER[kind]
    if lift >= corner:
        return R, 0.0
    reach = np.sqrt(corner**2 - (corner - lift) ** 2)
    return R - corner + reach, (corner - lift) / reach


def wanted_arcs(block, kind, tip, way, lift, count=1440):
    """Arcs on the front half, where the tool's surface moves towards the material, that meet it.

    Widths (rad) of the arcs, and of the gaps between them.
    """
    e = way[:2] / np.linalg.norm(way[:2])
    climb = way[2] / np.linalg.norm(way[:2])
    radius, run = radius_of(kind, lift)
    psi = (np.arange(count) + 0.5) / count * np.pi
    circle = tip[:2] + (radius - EDGE) * (np.cos(psi)[:, None] * [-e[1], e[0]] + np.sin(psi)[:, None] * e)
    meets = inside(block.slice(float(tip[2] + lift + FLOOR)).to_polygons(), circle) & (np.sin(psi) > climb * run)
    ends = np.flatnonzero(np.diff(np.concatenate(([0], meets.astype(int), [0]))))
    widths = np.diff(ends) * np.pi / count
    return widths[::2], widths[1::2]


def slices(engaged, row):
    """Of a place: height (middle, mm over the tip) and sum of the arcs (rad) of every slice in which the tool was looked at."""
    arcs = engaged.arcs.take(np.array([row]))
    new = np.concatenate(([True], arcs.start[1:] < arcs.stop[:-1]))  # arcs of a slice stand in order
    height = arcs.height[new]
    turn = np.bincount(np.cumsum(new) - 1, arcs.stop - arcs.start)
    top = engaged.depth[row] - np.concatenate((np.cumsum(height[::-1])[::-1][1:], [0.0]))
    return top - 0.5 * height, turn


def flat_slice(engaged, row):
    """The same for a cylinder, whose arcs all begin at its tip."""
    arcs = engaged.arcs.take(np.array([row]))
    lift = 0.4 * engaged.depth[row]
    return np.array([lift]), np.array([(arcs.stop - arcs.start)[arcs.height > lift].sum()])


def places(path, kind, per_motion):
    """Places (row, tip, way, block before the motion) where the tool cuts, and the engagement.

    Next to corners two circles of the tool lie so near that what counts as material, EDGE, moves where they cross by degrees.
    """
    engaged, _ = StockMemory(StockShape(LOW, HIGH), {NO_TOOL: ToolShape(kind, 2 * R, CORNER[kind])}).follow(path)
    block = manifold3d.Manifold.cube(list(map(float, HIGH - LOW))).translate(list(map(float, LOW)))
    for k in range(len(path)):
        way = path.end[k] - path.start[k]
        beside = BESIDE / np.linalg.norm(way)
        on = (engaged.motion == k) & (engaged.u > beside) & (engaged.u < 1.0 - beside) & (engaged.turn > 0.0)
        rows = np.flatnonzero(on)
        if np.linalg.norm(way[:2]) > 0.0:
            for row in rows[:: max(len(rows) // per_motion, 1)][:per_motion]:
                yield engaged, row, path.start[k] + engaged.u[row] * way, way, block
        block = block - manifold3d.Manifold.batch_hull([tool_at(kind, path.start[k]), tool_at(kind, path.end[k])])


CASES = {
    "flat": ("flat", LEVEL, 3), "ball": ("ball", LEVEL, 1), "ball-ramps": ("ball", RAMPS, 2),
    "bull-ramps": ("bull", RAMPS, 1), "ball-helix": ("ball", HELIX, 1), "bull-helix": ("bull", HELIX, 1),
}  # fmt: skip


@pytest.mark.parametrize(("kind", "moves", "per_motion"), CASES.values(), ids=CASES)
def test_arcs_and_depth_are_those_of_the_solid_that_is_left(kind, moves, per_motion):
    """Arcs in every third slice within half a degree, depth within 5 um.

    Arcs and gaps narrower than two cells may be missed and are not compared.
    """
    path = path_of(*moves, start=(5.0, 0.0, -2.0) if moves is HELIX else START)
    narrow = 2.0 * cell_for(StockShape(LOW, HIGH), {NO_TOOL: ToolShape(kind, 2 * R)})
    checked = 0
    for engaged, row, tip, way, block in places(path, kind, per_motion):
        depth, at = engaged.depth[row], (engaged.motion[row], engaged.u[row])
        lift, found = flat_slice(engaged, row) if kind == "flat" else slices(engaged, row)
        if kind != "flat" and len(lift) < SLICES:  # arcs between are missing, and nobody knows in which slices
            continue
        for height, turn in zip(lift[::3], found[::3], strict=True):
            wanted, gaps = wanted_arcs(block, kind, tip, way, float(height))
            if (np.concatenate((wanted, gaps)) * radius_of(kind, height)[0] > narrow).all():
                assert turn == pytest.approx(wanted.sum(), abs=np.radians(0.5)), (*at, height)
                checked += len(wanted) > 0
        if depth < -tip[2] - DEEP:
            assert (wanted_arcs(block, kind, tip, way, depth + DEEP)[0] * radius_of(kind, depth)[0] < narrow).all(), at
        assert depth < -tip[2] + 1e-9 and len(wanted_arcs(block, kind, tip, way, depth - DEEP)[0]), at
    assert checked >= 8
