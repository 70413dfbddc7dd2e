"""Removal of sweeps from a height field, and the test of rapids for collisions with the material."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import inner
from camcomp.model.stock.field import (
    BEGUN,
    CELL,
    FREE,
    GX,
    GY,
    HAIR,
    TIE,
    TOUCHED,
    USED,
    ZMAX,
    ZMIN,
    top_at,
)
from camcomp.model.stock.sweeps import (
    BALL,
    CLIMB,
    CONE,
    DRILL,
    KIND,
    LENGTH,
    NOWHERE,
    RADIUS,
    TOOL,
    UX,
    UY,
    WAY,
    X0,
    X1,
    Y0,
    Y1,
    Z0,
    Z1,
    across,
    bottom,
    bottom_at,
    squared_distance,
)

SAME_LEVEL = 0.02  # mm, tolerance of "about as low", plus the climb of a sweep within its tool
LEAN = 1e-6  # sine below which a direction is along a row or across it
CRASH_DEEP, CRASH_INSIDE = 0.01, 0.02  # mm: least depth of a collision, and reduction of the tool's radius


@inner
def strip(low, high, over, by):
    """Interval of x with low <= over * x + by * y <= high on the row y = 0, and its shift per mm of y."""
    if abs(over) <= LEAN:
        return -NOWHERE, NOWHERE, 0.0
    a, b = low / over, high / over
    return min(a, b) - HAIR, max(a, b) + HAIR, -by / over


@inner
def rows_between(nodes, k, radius, first, last):
    """First and last row of the field within reach of a sweep between two path lengths (mm)."""
    y0, ux, uy = nodes.sweeps[k, Y0], nodes.sweeps[k, UX], nodes.sweeps[k, UY]
    low = y0 + min(first * uy, last * uy) - radius * abs(ux) - nodes.place[GY] - HAIR
    high = y0 + max(first * uy, last * uy) + radius * abs(ux) - nodes.place[GY] + HAIR
    cell = nodes.place[CELL]
    return max(math.ceil(low / cell), 0), min(math.floor(high / cell), nodes.own.shape[0] - 1)


@inner
def put_sweep(nodes, x0, y0, z0, x1, y1, z1, tool):
    """Store a sweep that the field does not contain yet, and return its number, or -1 if there is no room."""
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
    climb = (z1 - z0) / length if length > 0.0 else 0.0
    s[k, CLIMB], s[k, WAY] = climb, math.sqrt(1.0 + climb * climb)
    nodes.kept[k] = -1
    return k


@inner
def drop_one(nodes, k):
    """Remove one reference to sweep k; its row becomes free with the last one."""
    nodes.kept[k] -= 1
    if nodes.kept[k] == 0:
        nodes.free[nodes.counts[FREE]] = k
        nodes.counts[FREE] += 1


@inner
def overhang(sweeps, tools, k, climb):
    """Distance (mm) beyond an end of a sweep in which the tool is lowest before that end; climb: towards the end, per mm."""
    row = 2 * int(sweeps[k, TOOL])
    if climb <= 0.0:
        return 0.0
    if tools[row, KIND] == BALL:
        return tools[row, RADIUS] * climb / math.sqrt(1.0 + climb * climb)
    if tools[row, KIND] == DRILL:
        return tools[row, RADIUS] * climb * tools[row, CONE]
    return NOWHERE


@inner
def cut_away(nodes, k, after):
    """Remove the material of sweep k from the field. after: number of the next sweep, -1: unknown.

    Consecutive sweeps share the region around their common point: a sweep skips the nodes beyond its end, which the next
    one cuts, and the nodes behind its start, which the one before has cut.
    """
    place, own, sweeps, tools = nodes.place, nodes.own, nodes.sweeps, nodes.tools
    tool, length = sweeps[k, TOOL], sweeps[k, LENGTH]
    radius = tools[2 * int(tool), RADIUS]
    cell, gx, gy = place[CELL], place[GX], place[GY]
    x0, y0, ux, uy = sweeps[k, X0], sweeps[k, Y0], sweeps[k, UX], sweeps[k, UY]
    last = nodes.last
    joined = (
        nodes.counts[BEGUN] == 1
        and last[0] == x0 and last[1] == y0 and last[2] == sweeps[k, Z0] and last[3] == tool and length > 0.0
    )  # fmt: skip
    goes_on = (
        after >= 0 and length > 0.0 and sweeps[after, X0] == sweeps[k, X1] and sweeps[after, Y0] == sweeps[k, Y1]
        and sweeps[after, Z0] == sweeps[k, Z1] and sweeps[after, TOOL] == tool
    )  # fmt: skip
    begun = -overhang(sweeps, tools, k, -sweeps[k, CLIMB]) if joined else -NOWHERE
    left = overhang(sweeps, tools, k, sweeps[k, CLIMB]) if goes_on else NOWHERE
    before, bx, by = last[6], last[4], last[5]
    first, beyond = -radius, min(length + left, length + radius)
    ball, slant = tools[2 * int(tool), KIND] == BALL, sweeps[k, CLIMB] / sweeps[k, WAY]
    if begun > -NOWHERE and bx * ux + by * uy > 0.0:  # only the overhang that the sweep before skipped
        back = min(begun, radius * last[7]) if ball else begun
        first = max(first, back - radius * abs(bx * uy - by * ux))
    nodes.kept[k] = 1  # reference that keeps its row during the removal
    bottom_row, top_row = rows_between(nodes, k, radius, first, beyond)
    if min(sweeps[k, Z0], sweeps[k, Z1]) >= place[ZMAX]:
        top_row = -1
    a, b, lean = strip(first, beyond, ux, uy)
    c, d, tilt = strip(-radius, radius, uy, -ux)
    width, off = own.shape[1] - 1, x0 - gx
    for i in range(bottom_row, top_row + 1):
        y = gy + i * cell
        dy = y - y0
        begin = max(a + lean * dy, c + tilt * dy)
        end = min(b + lean * dy, d + tilt * dy)
        for j in range(max(math.ceil((begin + off) / cell), 0), min(math.floor((end + off) / cell), width) + 1):
            x = gx + j * cell
            s = (x - x0) * ux + dy * uy
            behind = (x - x0) * bx + dy * by
            if s > length + left or (s < begun and behind <= before and not ball):
                continue
            n = (x - x0) * uy - dy * ux
            if ball:  # skip exactly the nodes of its neighbours
                square = radius * radius - n * n
                if square < 0.0:
                    continue
                t = s - slant * math.sqrt(square)
                if t > length and left < NOWHERE:
                    continue
                if t < 0.0 and joined:
                    aside = (x - x0) * by - dy * bx
                    square = radius * radius - aside * aside
                    if before == NOWHERE or square >= 0.0 and behind <= last[7] * math.sqrt(square):
                        continue
            cut_node(nodes, k, i, j, x, y, n, s)
    drop_one(nodes, k)
    last[0], last[1], last[2], last[3] = sweeps[k, X1], sweeps[k, Y1], sweeps[k, Z1], tool
    last[4], last[5], last[6], last[7] = ux, uy, left, slant
    nodes.counts[BEGUN] = 1


@inner
def cut_node(nodes, k, i, j, x, y, n, s):
    """Remove the material of sweep k at one node; n, s: coordinates of the node by `across`, mm."""
    own, low, near, over, sweeps, tools = nodes.own, nodes.low, nodes.near, nodes.over, nodes.sweeps, nodes.tools
    z = bottom_at(sweeps, tools, k, 0, n, s)
    if z >= NOWHERE:
        return
    before = own[i, j]
    stands = float(low[i, j]) if before > 0 else top_at(nodes, x, y, i, j)
    if z < stands - TIE:
        own[i, j] = k + 1
        low[i, j] = z
        nodes.kept[k] += 1
        nodes.counts[TOUCHED] += int(stands > nodes.place[ZMIN])
        if before > 0:
            drop_one(nodes, before - 1)
    elif before == 0:
        return
    aside = squared_distance(sweeps, k, n, s)
    lowest = float(low[i, j])
    level = SAME_LEVEL + 2.0 * tools[2 * int(sweeps[k, TOOL]), RADIUS] * abs(sweeps[k, CLIMB])
    first, second = near[i, j], over[i, j]
    away = 0.0
    if first > 0:
        n, s = across(sweeps, first - 1, x, y)
        away = squared_distance(sweeps, first - 1, n, s)
    if z <= lowest + level and (
        first == 0 or aside < away - HAIR or z < bottom_at(sweeps, tools, first - 1, 0, n, s) - level
    ):
        near[i, j] = k + 1
        nodes.kept[k] += 1
        if first > 0:
            drop_one(nodes, first - 1)
    if second > 0 and second != first:
        n, s = across(sweeps, second - 1, x, y)
        away = squared_distance(sweeps, second - 1, n, s)
    if second == 0 or aside < away + (HAIR if z <= lowest else -HAIR):
        over[i, j] = k + 1
        nodes.kept[k] += 1
        if second > 0:
            drop_one(nodes, second - 1)


@inner
def hits(nodes, k):
    """Whether the tool moves through material on sweep k."""
    place, own, low, sweeps, tools = nodes.place, nodes.own, nodes.low, nodes.sweeps, nodes.tools
    radius = tools[2 * int(sweeps[k, TOOL]), RADIUS] - CRASH_INSIDE
    cell, gx, gy = place[CELL], place[GX], place[GY]
    if min(sweeps[k, Z0], sweeps[k, Z1]) >= place[ZMAX] - CRASH_DEEP or radius <= 0.0:
        return False
    last = sweeps[k, LENGTH] + radius
    bottom_row, top_row = rows_between(nodes, k, radius, -radius, last)
    a, b, lean = strip(-radius, last, sweeps[k, UX], sweeps[k, UY])
    c, d, tilt = strip(-radius, radius, sweeps[k, UY], -sweeps[k, UX])
    off = sweeps[k, X0] - gx
    for i in range(bottom_row, top_row + 1):
        y = gy + i * cell
        dy = y - sweeps[k, Y0]
        begin = max(a + lean * dy, c + tilt * dy)
        end = min(b + lean * dy, d + tilt * dy)
        first = max(math.ceil((begin + off) / cell), 0)
        for j in range(first, min(math.floor((end + off) / cell), own.shape[1] - 1) + 1):
            x = gx + j * cell
            stands = float(low[i, j]) if own[i, j] > 0 else top_at(nodes, x, y, i, j)
            if stands > place[ZMIN] and max(bottom(sweeps, tools, k, 0, x, y), place[ZMIN]) < stands - CRASH_DEEP:
                return True
    return False
