"""Exact swept volume of a tool on a straight line: lowest height of the sweep over a point.

A tool is a body of revolution, given by its radius over height. Columns of a sweep: start and end of the tip, tool,
length and direction in the plane, climb per mm, path length per mm in the plane. Columns of a tool: radius, kind, corner
radius, tangent of the tip's half angle, lift of the tip. Every tool has a second, slimmer row for the latest sweeps.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import inner

FLAT, BALL, BULL, DRILL = 0, 1, 2, 3
X0, Y0, Z0, X1, Y1, Z1, TOOL, LENGTH, UX, UY, CLIMB, WAY = range(12)
RADIUS, KIND, CORNER, CONE, LIFT = range(5)
NOWHERE = 1e30  # mm, in place of infinity
LEVEL = 1e-12  # climb per mm
HALVINGS = 30


@inner
def profile(tools, row, square):
    """Height of the tool's surface over its tip, mm; square (mm2): of the distance from its axis."""
    kind = tools[row, KIND]
    lift = tools[row, LIFT]
    if kind == FLAT:
        return lift
    if kind == DRILL:
        return lift + math.sqrt(square) / tools[row, CONE]
    corner = tools[row, CORNER]
    if kind == BALL:
        return lift + corner - math.sqrt(max(corner * corner - square, 0.0))
    inside = math.sqrt(square) - (tools[row, RADIUS] - corner)
    if inside <= 0.0:
        return lift
    return lift + corner - math.sqrt(max(corner * corner - inside * inside, 0.0))


@inner
def slope(tools, row, rho):
    """Derivative of the profile."""
    kind = tools[row, KIND]
    if kind == FLAT:
        return 0.0
    if kind == DRILL:
        return 1.0 / tools[row, CONE]
    corner = tools[row, CORNER]
    inside = rho - (tools[row, RADIUS] - corner)
    if inside <= 0.0:
        return 0.0
    return inside / math.sqrt(max(corner * corner - inside * inside, 1e-18))


@inner
def radius_at(tools, row, height):
    """Radius of the tool at a height over its tip, mm."""
    kind = tools[row, KIND]
    radius = tools[row, RADIUS]
    if kind == FLAT:
        return radius
    if kind == DRILL:
        return min(radius, height * tools[row, CONE])
    corner = tools[row, CORNER]
    if height >= corner:
        return radius
    return radius - corner + math.sqrt(max(corner * corner - (corner - height) ** 2, 0.0))


@inner
def across(sweeps, k, x, y):
    """Coordinates of a point in the plane of a sweep, mm: to the right of its line, and along it from its start."""
    dx = x - sweeps[k, X0]
    dy = y - sweeps[k, Y0]
    return dx * sweeps[k, UY] - dy * sweeps[k, UX], dx * sweeps[k, UX] + dy * sweeps[k, UY]


@inner
def squared_distance(sweeps, k, n, s):
    """Square of the distance in the plane (mm2) of a point with coordinates by `across` from the line of a sweep."""
    off = s - min(max(s, 0.0), sweeps[k, LENGTH])
    return n * n + off * off


@inner
def rises(tools, row, climb, aside, along):
    """Whether the tool's surface over a point rises with its motion; aside, along: from the point to the tool, mm."""
    rho = math.sqrt(aside * aside + along * along)
    return climb + slope(tools, row, rho) * along / max(rho, 1e-12) > 0.0


@inner
def bottom(sweeps, tools, k, slim, x, y):
    """Lowest height of sweep k over a point, mm; NOWHERE beyond its reach. slim: 1 for the slimmer tool."""
    n, s = across(sweeps, k, x, y)
    return bottom_at(sweeps, tools, k, slim, n, s)


@inner
def bottom_at(sweeps, tools, k, slim, n, s):
    """Lowest height of sweep k over a point with coordinates n, s by `across`, mm."""
    row = 2 * int(sweeps[k, TOOL]) + slim
    radius = tools[row, RADIUS]
    square = squared_distance(sweeps, k, n, s)
    if square > radius * radius:
        return NOWHERE
    length, climb = sweeps[k, LENGTH], sweeps[k, CLIMB]
    if abs(climb) < LEVEL:
        z = sweeps[k, Z0] if length > 0.0 else min(sweeps[k, Z0], sweeps[k, Z1])
        return z + profile(tools, row, square)
    half = math.sqrt(max(radius * radius - n * n, 0.0))
    kind = tools[row, KIND]
    low = max(0.0, s - half)
    high = min(length, s + half)
    if kind == FLAT:
        return sweeps[k, Z0] + climb * (low if climb >= 0.0 else high) + tools[row, LIFT]
    if kind == BALL:
        way = sweeps[k, WAY]
        t = s - climb * half / way
        if 0.0 <= t <= length:
            return sweeps[k, Z0] + tools[row, LIFT] + climb * s + radius - half * way
        t = min(max(t, 0.0), length)
    else:  # the height is convex along the way
        a, b = low, high
        if rises(tools, row, climb, n, a - s):
            b = a
        elif not rises(tools, row, climb, n, b - s):
            a = b
        else:
            for _ in range(HALVINGS):
                t = 0.5 * (a + b)
                if rises(tools, row, climb, n, t - s):
                    b = t
                else:
                    a = t
        t = 0.5 * (a + b)
    return sweeps[k, Z0] + climb * t + profile(tools, row, min(n * n + (t - s) * (t - s), radius * radius))


@inner
def passes(sweeps, tools, k, slim, x, y, z):
    """Whether sweep k reaches a height over a point: `bottom(...) <= z`."""
    row = 2 * int(sweeps[k, TOOL]) + slim
    length, climb = sweeps[k, LENGTH], sweeps[k, CLIMB]
    if tools[row, KIND] != BALL or length == 0.0:
        return bottom(sweeps, tools, k, slim, x, y) <= z
    n, s = across(sweeps, k, x, y)
    left = tools[row, RADIUS] * tools[row, RADIUS] - n * n
    if left < 0.0:
        return False
    # Distance from the line of the ball's centre, around which the sweep is a cylinder.
    up = z - (sweeps[k, Z0] + tools[row, LIFT] + tools[row, RADIUS])
    t = min(max((s + climb * up) / (sweeps[k, WAY] * sweeps[k, WAY]), 0.0), length)
    off, over = t - s, up - climb * t
    if off * off + over * over <= left:
        return True
    low, high = 0.0, length  # where the centre is not above the height
    if max(up, up - climb * length) < 0.0:
        return False
    if climb > 0.0:
        high = min(high, up / climb)
    elif climb < 0.0:
        low = max(low, up / climb)
    off = min(max(s, low), high) - s
    return off * off <= left
