"""Takes sweeps out of a field, and tells whether one would go through what stands."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.model.statics.compiled import inner
from camcomp.model.stock.field import BEGUN, CELL, FREE, GX, GY, HAIR, TIE, TOUCHED, USED, ZMAX, ZMIN, top_at
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
    X0,
    X1,
    Y0,
    Y1,
    Z0,
    Z1,
    beside,
    bottom,
)

SAME_LEVEL = 0.02  # mm, and what a sweep climbs within its tool
CRASH_DEEP, CRASH_INSIDE = 0.01, 0.02  # mm that a rapid has to be in material before it is called a crash


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
def overhang(sweeps, tools, k, climb):
    """How far beyond the end of a sweep, mm, the tool reaches lowest before it is there; climb: towards that end."""
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
    """Takes the material of sweep k out of the field. after: the sweep that is going to be next, -1: not known.

    Where sweeps go on from each other, what lies beyond the end of one is left to the next, which begins there, and what
    lies behind its begin has been cut by the one before.
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
    lowest = -NOWHERE
    if begun > -NOWHERE and bx * ux + by * uy > 0.0:
        lowest = begun - radius * abs(bx * uy - by * ux)  # of what the one before has left, as it was beyond its end
    nodes.kept[k] = 1  # it must not be freed meanwhile
    bottom_row = max(math.ceil((min(y0, sweeps[k, Y1]) - radius - gy) / cell), 0)
    top_row = min(math.floor((max(y0, sweeps[k, Y1]) + radius - gy) / cell), own.shape[0] - 1)
    if min(sweeps[k, Z0], sweeps[k, Z1]) >= place[ZMAX]:
        top_row = -1
    for i in range(bottom_row, top_row + 1):
        dy = gy + i * cell - y0
        begin, end = row_span(sweeps, k, radius, gy + i * cell)
        if abs(ux) > 1e-6:
            a = x0 + (lowest - dy * uy) / ux
            b = x0 + (length + left - dy * uy) / ux
            begin, end = max(begin, min(a, b) - HAIR), min(end, max(a, b) + HAIR)
        elif dy * uy < lowest - 1e-3 or dy * uy > length + left + 1e-3:
            continue
        if begin > end:
            continue
        for j in range(
            max(math.ceil((begin - gx) / cell), 0), min(math.floor((end - gx) / cell), own.shape[1] - 1) + 1
        ):
            x = gx + j * cell
            s = (x - x0) * ux + dy * uy
            if s > length + left or (s < begun and (x - x0) * bx + dy * by <= before):
                continue
            cut_node(nodes, k, i, j, x, gy + i * cell)
    drop_one(nodes, k)
    last[0], last[1], last[2], last[3] = sweeps[k, X1], sweeps[k, Y1], sweeps[k, Z1], tool
    last[4], last[5], last[6] = ux, uy, left
    nodes.counts[BEGUN] = 1


@inner
def cut_node(nodes, k, i, j, x, y):
    """Takes the material of sweep k out of a node."""
    own, low, near, over, sweeps, tools = nodes.own, nodes.low, nodes.near, nodes.over, nodes.sweeps, nodes.tools
    z = bottom(sweeps, tools, k, 0, x, y)
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
    if own[i, j] == 0:
        return
    aside = beside(sweeps, k, x, y)
    level = SAME_LEVEL + 2.0 * tools[2 * int(sweeps[k, TOOL]), RADIUS] * abs(sweeps[k, CLIMB])
    if z <= float(low[i, j]) + level:
        other = near[i, j]
        if (
            other == 0
            or z < bottom(sweeps, tools, other - 1, 0, x, y) - level
            or aside < beside(sweeps, other - 1, x, y) - HAIR
        ):
            near[i, j] = k + 1
            nodes.kept[k] += 1
            if other > 0:
                drop_one(nodes, other - 1)
    other = over[i, j]
    if other == 0 or aside < beside(sweeps, other - 1, x, y) + (HAIR if z <= float(low[i, j]) else -HAIR):
        over[i, j] = k + 1
        nodes.kept[k] += 1
        if other > 0:
            drop_one(nodes, other - 1)


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
