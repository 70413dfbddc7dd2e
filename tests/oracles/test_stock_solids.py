"""The engagement against exact solids: a block minus the swept tools of all earlier moves, made by another library."""

import numpy as np
import pytest

from camcomp.model.stock.memory import NO_TOOL, StockMemory
from camcomp.model.stock.shapes import StockShape, ToolShape
from tests.paths import path_of

manifold3d = pytest.importorskip("manifold3d", reason="the solids are made by manifold3d, part of camcomp[dev]")

R, SEGMENTS = 4.0, 1440
LOW, HIGH = np.array([-25.0, -25.0, -10.0]), np.array([25.0, 25.0, 0.0])
MOVES = [
    ("line", (12, -3, -3.0)), ("line", (14, 9, -3.0)), ("line", (-9, 11, -3.0)), ("line", (-13, -9, -3.0)), ("line", (-13, -9, -5.0)),
    ("line", (9, -12, -5.0)), ("line", (2, 3, -5.0)), ("line", (-16, 2, -5.0)),
]  # fmt: skip
START = (-15.0, -4.0, -3.0)


def tool_at(kind, tip):
    if kind == "ball":
        ball = manifold3d.Manifold.sphere(R, 160).translate([0, 0, R])
        body = ball + manifold3d.Manifold.cylinder(30.0, R, R, 160).translate([0, 0, R])
    else:
        body = manifold3d.Manifold.cylinder(30.0, R, R, SEGMENTS)
    return body.translate(list(map(float, tip)))


def inside(polygons, points):
    """Which points (n, 2) lie in polygons, by the number of edges to their right."""
    odd = np.zeros(len(points), bool)
    for polygon in polygons:
        a, b = polygon, np.roll(polygon, -1, axis=0)
        for (xa, ya), (xb, yb) in zip(a, b, strict=True):
            crosses = (ya > points[:, 1]) != (yb > points[:, 1])
            x = xa + (points[:, 1] - ya) / (yb - ya if yb != ya else 1.0) * (xb - xa)
            odd ^= crosses & (points[:, 0] < x)
    return odd


@pytest.mark.parametrize("kind", ["flat", "ball"])
def test_arcs_are_those_of_the_solid_that_is_left(kind):
    path = path_of(*MOVES, start=START)
    engaged, _ = StockMemory(StockShape(LOW, HIGH), {NO_TOOL: ToolShape(kind, 2.0 * R)}).follow(path)
    block = manifold3d.Manifold.cube(list(map(float, HIGH - LOW))).translate(list(map(float, LOW)))
    checked = 0
    for k in range(len(path)):
        way = path.end[k] - path.start[k]
        e = way[:2] / max(np.linalg.norm(way[:2]), 1e-9)  # a plunge has no places
        rows = np.flatnonzero((engaged.motion == k) & (engaged.u > 0.02) & (engaged.u < 0.98))
        for row in rows[:: max(len(rows) // 3, 1)]:
            tip = path.start[k] + engaged.u[row] * way
            bites = engaged.bites.of(np.array([row]))
            low = 0.0 if kind == "flat" else engaged.depth[row] - np.unique(bites.height).sum()
            lift = 0.4 * engaged.depth[row] if kind == "flat" else max(low, 0.0) + 0.55 * engaged.depth[row]
            radius = R if kind == "flat" else np.sqrt(R**2 - max(R - lift, 0.0) ** 2)
            psi = (np.arange(7200) + 0.5) / 7200 * np.pi
            circle = tip[:2] + (radius - 2e-3) * (np.cos(psi)[:, None] * [-e[1], e[0]] + np.sin(psi)[:, None] * e)
            wanted = np.pi * inside(block.slice(float(tip[2] + lift)).to_polygons(), circle).mean()
            if kind == "flat":
                found = sum(b - a for a, b, h in zip(bites.start, bites.stop, bites.height, strict=True) if h > lift)
                assert found == pytest.approx(wanted, abs=np.radians(0.5)), (k, engaged.u[row])
            else:
                assert engaged.turn[row] >= wanted - np.radians(0.5), (k, engaged.u[row])
            checked += wanted > 0.0
        block = block - manifold3d.Manifold.batch_hull([tool_at(kind, path.start[k]), tool_at(kind, path.end[k])])
    assert checked > 5
