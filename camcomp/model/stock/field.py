"""Height field of the stock: every node stores the sweep that cuts lowest there.

The height over a point between nodes is the minimum over the sweeps of the nodes around it, evaluated at the point
itself. Edges and floors are therefore as exact as the moves; only features below one cell, such as a sliver between two
passes, can be missed. A node also stores the nearest sweep, among those of about the same height and among all: these
form the walls between nodes.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

from typing import Any, NamedTuple

import numpy as np

from camcomp.ground.compiled import inner
from camcomp.ground.datatypes import Floats
from camcomp.model.stock.sweeps import NOWHERE, bottom, passes

BOX, ROUND, MESH = 0, 1, 2
GX, GY, CELL, FORM, XMIN, YMIN, ZMIN, XMAX, YMAX, ZMAX, RISE = range(
    11
)  # of `place`; a round stock fills its rectangle
TIE = 1e-5  # mm: heights are kept with seven digits
HAIR = 1e-9  # mm
ONE, TWO, THREE = np.uint64(1), np.uint64(2), np.uint64(3)  # unsigned: numba then skips the test for negative indices
USED, FREE, TOUCHED, BEGUN = range(4)  # of `counts`
# Radius in cells of the smallest circle that always contains a node. A sweep is low over circles: within SPAN of a low
# point lies a node that is as low, except for the rise of the tool over SPAN.
SPAN = 0.7072


class HeightField(NamedTuple):
    """Height field of ny times nx nodes with M sweeps, T rows of tools and the F triangles of a stock from a file."""

    place: Floats  # (11,) first node, cell, form and bounds of the stock, how much a tool rises within SPAN, mm
    own: Any  # (ny, nx) int32, sweep that cuts a node lowest, counted from 1; 0: uncut
    low: Any  # (ny, nx) float32, height there, mm; the top of a box where uncut
    near: Any  # (ny, nx) int32, sweep that passes nearest, of those that cut about as low
    over: Any  # (ny, nx) int32, sweep that passes nearest of all
    sweeps: Floats  # (M, 12)
    tools: Floats  # (T, 5)
    kept: Any  # (M,) int32, number of references to a sweep in these; below 0: not in the field yet
    free: Any  # (M,) int32, stack of free rows of `sweeps`
    counts: Any  # (4,) int64
    last: Floats  # (8,) of the sweep cut last: end, tool, direction, overhang that it did not cut (mm), slant
    facet: Any  # (ny, nx) int32 triangle on top of a node, counted from 1; 0: none
    mesh: Floats  # (F, 3, 3) mm, its triangles


@inner
def over_facet(mesh, f, x, y):
    """Height of a triangle over a point, mm; -NOWHERE outside its outline."""
    ax, ay, az = mesh[f, 0, 0], mesh[f, 0, 1], mesh[f, 0, 2]
    bx, by, bz = mesh[f, 1, 0] - ax, mesh[f, 1, 1] - ay, mesh[f, 1, 2] - az
    cx, cy, cz = mesh[f, 2, 0] - ax, mesh[f, 2, 1] - ay, mesh[f, 2, 2] - az
    area = bx * cy - by * cx
    if area == 0.0:
        return -NOWHERE
    v = ((x - ax) * cy - (y - ay) * cx) / area
    w = (bx * (y - ay) - by * (x - ax)) / area
    if v < -1e-7 or w < -1e-7 or v + w > 1.0 + 1e-7:
        return -NOWHERE
    return az + v * bz + w * cz


@inner
def top_at(nodes, x, y, i, j):
    """Height of the uncut stock over a point of the cell (i, j), mm; -NOWHERE outside its outline."""
    place = nodes.place
    if x < place[XMIN] - HAIR or x > place[XMAX] + HAIR or y < place[YMIN] - HAIR or y > place[YMAX] + HAIR:
        return -NOWHERE
    if place[FORM] == BOX:
        return place[ZMAX]
    if place[FORM] == ROUND:
        radius = 0.5 * (place[XMAX] - place[XMIN])
        dx = x - 0.5 * (place[XMIN] + place[XMAX])
        dy = y - 0.5 * (place[YMIN] + place[YMAX])
        return place[ZMAX] if dx * dx + dy * dy <= radius * radius + HAIR else -NOWHERE
    best = -NOWHERE
    seen = 0
    for a in range(max(i - 1, 0), min(i + 3, nodes.facet.shape[0])):
        for b in range(max(j - 1, 0), min(j + 3, nodes.facet.shape[1])):
            f = nodes.facet[a, b]
            if f > 0 and f != seen:
                best = max(best, over_facet(nodes.mesh, f - 1, x, y))
                seen = f
    return best


@inner
def height(nodes, x, y, below):
    """Height of the material over a point, mm; -NOWHERE outside the stock.

    Where the material is lower than `below`, the value is only an upper bound that is at most `below`.
    """
    place, own, low = nodes.place, nodes.own, nodes.low
    fx = (x - place[GX]) / place[CELL]
    fy = (y - place[GY]) / place[CELL]
    if not (fx >= 1.0 and fy >= 1.0 and fx < own.shape[1] - 3 and fy < own.shape[0] - 3):
        return -NOWHERE
    j = int(fx)
    i = int(fy)
    a, b, c, d = own[i, j], own[i, j + 1], own[i + 1, j], own[i + 1, j + 1]
    if a == b and a == c and a == d:
        best = top_at(nodes, x, y, i, j)
        if a > 0:
            best = min(best, bottom(nodes.sweeps, nodes.tools, a - 1, 0, x, y))
        return best
    if a > 0 and b > 0 and c > 0 and d > 0:
        highest = max(max(low[i, j], low[i, j + 1]), max(low[i + 1, j], low[i + 1, j + 1]))
        if highest <= below + TIE:
            return min(float(highest), below)
        lowest = min(min(low[i, j], low[i, j + 1]), min(low[i + 1, j], low[i + 1, j + 1]))
        if highest - lowest <= TIE:  # a level floor: bulges between its nodes are below the resolution
            return float(highest)
    best = top_at(nodes, x, y, i, j)
    for corner in range(4):  # most points without material end here
        k = (a, b, c, d)[corner]
        if k > 0:
            best = min(best, bottom(nodes.sweeps, nodes.tools, k - 1, 0, x, y))
            if best <= below:
                return best
    near, over = nodes.near, nodes.over
    for p in range(i - 1, i + 3):
        for q in range(j - 1, j + 3):
            k = own[p, q]
            if k == 0:
                continue
            if (
                k != a and k != b and k != c and k != d
                and (q == j - 1 or own[p, q - 1] != k) and (p == i - 1 or own[p - 1, q] != k)
            ):  # fmt: skip
                best = min(best, bottom(nodes.sweeps, nodes.tools, k - 1, 0, x, y))
            n = near[p, q]
            if n != k and (q == j - 1 or near[p, q - 1] != n) and (p == i - 1 or near[p - 1, q] != n):
                best = min(best, bottom(nodes.sweeps, nodes.tools, n - 1, 0, x, y))
            m = over[p, q]
            if m != k and m != n and (q == j - 1 or over[p, q - 1] != m) and (p == i - 1 or over[p - 1, q] != m):
                best = min(best, bottom(nodes.sweeps, nodes.tools, m - 1, 0, x, y))
            if best <= below:
                return best
    return best


@inner
def above(nodes, x, y, z):
    """Whether the material over a point is higher than z (mm): equals `height(...) > z`, mostly without evaluating sweeps."""
    place, own, low = nodes.place, nodes.own, nodes.low
    cell = place[CELL]
    fx = (x - place[GX]) / cell
    fy = (y - place[GY]) / cell
    if not (fx >= 1.0 and fy >= 1.0 and fx < own.shape[1] - 3 and fy < own.shape[0] - 3):
        return False
    j, i = np.uint64(int(fx)), np.uint64(int(fy))
    highest = max(max(low[i, j], low[i, j + ONE]), max(low[i + ONE, j], low[i + ONE, j + ONE]))
    lowest = min(min(low[i, j], low[i, j + ONE]), min(low[i + ONE, j], low[i + ONE, j + ONE]))
    a, b, c, d = own[i, j], own[i, j + ONE], own[i + ONE, j], own[i + ONE, j + ONE]
    if a > 0 and b > 0 and c > 0 and d > 0 and (a != b or a != c or a != d) and highest - lowest <= TIE:
        return highest > z + TIE
    if lowest - place[RISE] > z and place[FORM] == BOX and (
        min(x - place[XMIN], place[XMAX] - x) > 2.0 * cell and min(y - place[YMIN], place[YMAX] - y) > 2.0 * cell
    ):  # fmt: skip
        for row in (i - ONE, i + TWO):
            for column in (j - ONE, j, j + ONE, j + TWO):
                lowest = min(lowest, low[row, column])
        for row in (i, i + ONE):
            for column in (j - ONE, j + TWO):
                lowest = min(lowest, low[row, column])
        if lowest - place[RISE] > z:
            return True
    sweeps, tools = nodes.sweeps, nodes.tools
    if top_at(nodes, x, y, int(i), int(j)) <= z:
        return False
    if a == b and a == c and a == d:
        return not (a > 0 and passes(sweeps, tools, a - 1, 0, x, y, z))
    before = 0
    for corner in range(4):
        k = (a, b, c, d)[corner]
        if k > 0 and k != before and passes(sweeps, tools, k - 1, 0, x, y, z):
            return False
        before = k
    near, over = nodes.near, nodes.over
    for p in range(i - ONE, i + THREE):
        for q in range(j - ONE, j + THREE):
            k = own[p, q]
            if k == 0:
                continue
            n, m = near[p, q], over[p, q]
            if (
                k != a and k != b and k != c and k != d
                and (q == j - ONE or own[p, q - ONE] != k) and (p == i - ONE or own[p - ONE, q] != k)
                and passes(sweeps, tools, k - 1, 0, x, y, z)
            ):  # fmt: skip
                return False
            if (
                n != k and (q == j - ONE or near[p, q - ONE] != n) and (p == i - ONE or near[p - ONE, q] != n)
                and passes(sweeps, tools, n - 1, 0, x, y, z)
            ):  # fmt: skip
                return False
            if (
                m != k and m != n and (q == j - ONE or over[p, q - ONE] != m) and (p == i - ONE or over[p - ONE, q] != m)
                and passes(sweeps, tools, m - 1, 0, x, y, z)
            ):  # fmt: skip
                return False
    return True


def room_for(
    place: Floats, rows: int, columns: int, tools: Floats, sweeps: int, *, facet: Any, mesh: Floats
) -> HeightField:
    """Allocate an uncut height field; untouched pages of it take no memory, except the heights of a box."""
    low = (
        np.full((rows, columns), place[ZMAX], np.float32)
        if place[FORM] == BOX
        else np.zeros((rows, columns), np.float32)
    )
    return HeightField(
        place=place,
        own=np.zeros((rows, columns), np.int32),
        low=low,
        near=np.zeros((rows, columns), np.int32),
        over=np.zeros((rows, columns), np.int32),
        sweeps=np.empty((sweeps, 12)),
        tools=tools,
        kept=np.zeros(sweeps, np.int32),
        free=np.zeros(sweeps, np.int32),
        counts=np.zeros(4, np.int64),
        last=np.zeros(8),
        facet=facet,
        mesh=mesh,
    )
