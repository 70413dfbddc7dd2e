"""The stock as a field of nodes, each of which knows the sweep that cut lowest there.

Between nodes nothing is interpolated: the sweeps of the nodes around a point are put to the point itself, so that edges
and floors are as exact as the moves are, and only what is smaller than a cell, such as a sliver between two passes, can
be missed. A node also knows which sweep passes nearest, of those that cut about as low and of all: the walls between
nodes are theirs.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math
from typing import Any, NamedTuple

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.statics.compiled import inner
from camcomp.model.stock.sweeps import (
    CLIMB,
    FLAT,
    KIND,
    LENGTH,
    LEVEL,
    NOWHERE,
    RADIUS,
    TOOL,
    UX,
    UY,
    X0,
    X1,
    Y0,
    Y1,
    Z0,
    Z1,
    beside,
    bottom,
)

BOX, ROUND, MESH = 0, 1, 2
GX, GY, CELL, FORM, XMIN, YMIN, ZMIN, XMAX, YMAX, ZMAX = range(10)  # of `place`; a round stock fills its rectangle
TIE = 1e-5  # mm: heights are kept with seven digits
HAIR = 1e-9  # mm
RIM = 3  # cells from an edge within which it matters which sweep passes nearest
SAME_LEVEL = 0.02  # mm, and what a sweep climbs within its tool
CRASH_DEEP, CRASH_INSIDE = 0.01, 0.02  # mm that a rapid has to be in material before it is called a crash
USED, FREE, TOUCHED, BEGUN = range(4)  # of `counts`


class HeightField(NamedTuple):
    """The field. ny, nx nodes; M sweeps; T rows of tools; the mesh of a stock from a file."""

    place: Floats  # (10,) first node, cell, form and bounds of the stock, mm
    own: Any  # (ny, nx) int32, sweep that cut a node lowest, counted from 1; 0: nothing did
    low: Any  # (ny, nx) float32, height there, mm
    near: Any  # (ny, nx) int32, sweep that passes nearest, of those that cut about as low
    over: Any  # (ny, nx) int32, sweep that passes nearest of all
    sweeps: Floats  # (M, 11)
    tools: Floats  # (T, 5)
    kept: Any  # (M,) int32, how often a sweep stands in these; below 0: it is still to be cut away
    free: Any  # (M,) int32, stack of places in `sweeps` that can be used again
    counts: Any  # (4,) int64
    last: Floats  # (4,) end and tool of the sweep that was cut away last
    facet: Any  # (ny, nx) int32 triangle on top of a node, counted from 1; 0: none
    mesh: Floats  # (F, 3, 3) mm, its triangles


@inner
def over_facet(mesh, f, x, y):
    """Height of a triangle over a point, -NOWHERE beside it."""
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
    """Height of the uncut stock over a point of the cell (i, j), -NOWHERE beside it."""
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
    """Height of what stands over a point, mm; -NOWHERE where there is nothing. What is lower than `below` is only said to be."""
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
        if highest - lowest <= TIE:  # a level floor; what bulges in between is thinner than what counts
            return float(highest)
    best = top_at(nodes, x, y, i, j)
    near, over = nodes.near, nodes.over
    for p in range(i - 1, i + 3):
        for q in range(j - 1, j + 3):
            k = own[p, q]
            if k == 0:
                continue
            if (q == j - 1 or own[p, q - 1] != k) and (p == i - 1 or own[p - 1, q] != k):
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
def row_span(sweeps, k, radius, y):
    """From where to where, in x, a sweep of this radius covers a row of the field; nowhere when the first is larger."""
    low, high = NOWHERE, -NOWHERE
    for end in range(2):
        x = sweeps[k, X1] if end else sweeps[k, X0]
        dy = y - (sweeps[k, Y1] if end else sweeps[k, Y0])
        if abs(dy) <= radius:
            half = math.sqrt(radius * radius - dy * dy)
            low = min(low, x - half)
            high = max(high, x + half)
    for side in (-1.0, 1.0):
        ox, oy = side * radius * sweeps[k, UY], -side * radius * sweeps[k, UX]
        ya, yb = sweeps[k, Y0] + oy, sweeps[k, Y1] + oy
        if ya != yb and min(ya, yb) <= y <= max(ya, yb):
            x = sweeps[k, X0] + ox + (y - ya) / (yb - ya) * (sweeps[k, X1] - sweeps[k, X0])
            low = min(low, x)
            high = max(high, x)
    return low, high


@inner
def put_sweep(nodes, x0, y0, z0, x1, y1, z1, tool):
    """Number of a new sweep, which nothing is cut by yet; -1 when there is no room."""
    counts = nodes.counts
    if counts[FREE] > 0:
        counts[FREE] -= 1
        k = int(nodes.free[counts[FREE]])
    elif counts[USED] < nodes.sweeps.shape[0]:
        k = int(counts[USED])
        counts[USED] += 1
    else:
        return -1
    s = nodes.sweeps
    s[k, X0], s[k, Y0], s[k, Z0], s[k, X1], s[k, Y1], s[k, Z1] = x0, y0, z0, x1, y1, z1
    s[k, TOOL] = tool
    length = math.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2)
    if length < 1e-7:
        length = 0.0
    s[k, LENGTH] = length
    s[k, UX] = (x1 - x0) / length if length > 0.0 else 1.0
    s[k, UY] = (y1 - y0) / length if length > 0.0 else 0.0
    s[k, CLIMB] = (z1 - z0) / length if length > 0.0 else 0.0
    nodes.kept[k] = -1
    return k


@inner
def drop_one(nodes, k):
    """Sweep k stands at a place less; without any its number is free."""
    nodes.kept[k] -= 1
    if nodes.kept[k] == 0:
        nodes.free[nodes.counts[FREE]] = k
        nodes.counts[FREE] += 1


@inner
def cut_away(nodes, k):
    """Takes the material of sweep k out of the field."""
    place, own, low, sweeps, tools, kept = nodes.place, nodes.own, nodes.low, nodes.sweeps, nodes.tools, nodes.kept
    row = 2 * int(sweeps[k, TOOL])
    radius = tools[row, RADIUS]
    flat = tools[row, KIND] == FLAT
    cell, gx, gy = place[CELL], place[GX], place[GY]
    near, over, level = nodes.near, nodes.over, SAME_LEVEL + 2.0 * radius * abs(sweeps[k, CLIMB])
    kept[k] = 1  # it must not be freed meanwhile
    deepest = min(sweeps[k, Z0], sweeps[k, Z1])
    last = nodes.last
    joined = (
        nodes.counts[BEGUN] == 1
        and last[0] == sweeps[k, X0] and last[1] == sweeps[k, Y0] and last[2] == sweeps[k, Z0]
        and last[3] == sweeps[k, TOOL] and sweeps[k, CLIMB] >= 0.0 and sweeps[k, LENGTH] > 0.0
    )  # fmt: skip
    # What lies well inside the tool at its start has been cut as low before.
    core = radius - RIM * cell if joined and flat and sweeps[k, CLIMB] < LEVEL else -1.0
    bottom_row = max(math.ceil((min(sweeps[k, Y0], sweeps[k, Y1]) - radius - gy) / cell), 0)
    top_row = min(math.floor((max(sweeps[k, Y0], sweeps[k, Y1]) + radius - gy) / cell), own.shape[0] - 1)
    if deepest >= place[ZMAX]:
        top_row = -1
    for i in range(bottom_row, top_row + 1):
        y = gy + i * cell
        begin, end = row_span(sweeps, k, radius, y)
        if begin > end:
            continue
        j = max(math.ceil((begin - gx) / cell), 0)
        stop = min(math.floor((end - gx) / cell), own.shape[1] - 1)
        skip_from, skip_to = stop + 1, stop
        dy = y - sweeps[k, Y0]
        if core > abs(dy):
            half = math.sqrt(core * core - dy * dy)
            skip_from = math.ceil((sweeps[k, X0] - half - gx) / cell)
            skip_to = math.floor((sweeps[k, X0] + half - gx) / cell)
        while j <= stop:
            if skip_from <= j <= skip_to:
                j = skip_to + 1
                continue
            x = gx + j * cell
            if joined and (x - sweeps[k, X0]) * sweeps[k, UX] + dy * sweeps[k, UY] < 0.0:
                j += 1
                continue
            z = bottom(sweeps, tools, k, 0, x, y)
            if z < NOWHERE:
                before = own[i, j]
                stands = float(low[i, j]) if before > 0 else top_at(nodes, x, y, i, j)
                if z < stands - TIE:
                    own[i, j] = k + 1
                    low[i, j] = z
                    kept[k] += 1
                    nodes.counts[TOUCHED] += int(stands > place[ZMIN])
                    if before > 0:
                        drop_one(nodes, before - 1)
                if own[i, j] > 0:
                    aside = beside(sweeps, k, x, y)
                    if z <= float(low[i, j]) + level:
                        other = near[i, j]
                        if (
                            other == 0
                            or z < bottom(sweeps, tools, other - 1, 0, x, y) - level
                            or aside < beside(sweeps, other - 1, x, y) - HAIR
                        ):
                            near[i, j] = k + 1
                            kept[k] += 1
                            if other > 0:
                                drop_one(nodes, other - 1)
                    other = over[i, j]
                    if other == 0 or aside < beside(sweeps, other - 1, x, y) + (
                        HAIR if z <= float(low[i, j]) else -HAIR
                    ):
                        over[i, j] = k + 1
                        kept[k] += 1
                        if other > 0:
                            drop_one(nodes, other - 1)
            j += 1
    drop_one(nodes, k)
    last[0], last[1], last[2], last[3] = sweeps[k, X1], sweeps[k, Y1], sweeps[k, Z1], sweeps[k, TOOL]
    nodes.counts[BEGUN] = 1


@inner
def hits(nodes, k):
    """Whether the tool goes through material on sweep k."""
    place, own, low, sweeps, tools = nodes.place, nodes.own, nodes.low, nodes.sweeps, nodes.tools
    radius = tools[2 * int(sweeps[k, TOOL]), RADIUS] - CRASH_INSIDE
    cell, gx, gy = place[CELL], place[GX], place[GY]
    if min(sweeps[k, Z0], sweeps[k, Z1]) >= place[ZMAX] - CRASH_DEEP or radius <= 0.0:
        return False
    bottom_row = max(math.ceil((min(sweeps[k, Y0], sweeps[k, Y1]) - radius - gy) / cell), 0)
    top_row = min(math.floor((max(sweeps[k, Y0], sweeps[k, Y1]) + radius - gy) / cell), own.shape[0] - 1)
    for i in range(bottom_row, top_row + 1):
        y = gy + i * cell
        begin, end = row_span(sweeps, k, radius, y)
        first = max(math.ceil((begin - gx) / cell), 0)
        for j in range(first, min(math.floor((end - gx) / cell), own.shape[1] - 1) + 1):
            x = gx + j * cell
            stands = float(low[i, j]) if own[i, j] > 0 else top_at(nodes, x, y, i, j)
            if stands > place[ZMIN] and max(bottom(sweeps, tools, k, 0, x, y), place[ZMIN]) < stands - CRASH_DEEP:
                return True
    return False


def room_for(
    place: Floats, rows: int, columns: int, tools: Floats, sweeps: int, facet: Any, mesh: Floats
) -> HeightField:
    """An uncut field. Pages that no tool has touched take no memory."""
    return HeightField(
        place, np.zeros((rows, columns), np.int32), np.zeros((rows, columns), np.float32),
        np.zeros((rows, columns), np.int32), np.zeros((rows, columns), np.int32), np.empty((sweeps, 11)), tools,
        np.zeros(sweeps, np.int32), np.zeros(sweeps, np.int32), np.zeros(4, np.int64), np.zeros(4), facet, mesh,
    )  # fmt: skip
