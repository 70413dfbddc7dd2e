"""What a tool takes away on a straight way, exactly: the lowest height that its sweep reaches over a point.

A tool is a body of revolution, given by its radius over height. Columns of a sweep: begin and end of the tip, tool,
length and direction in the plane, climb per mm. Columns of a tool: radius, kind, corner radius, tangent of the tip's
half angle, lift of the tip. Every tool has a second row, a hair slimmer: what the tool has just taken counts by that.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.model.statics.compiled import inner

FLAT, BALL, BULL, DRILL = 0, 1, 2, 3
X0, Y0, Z0, X1, Y1, Z1, TOOL, LENGTH, UX, UY, CLIMB = range(11)
RADIUS, KIND, CORNER, CONE, LIFT = range(5)
NOWHERE = 1e30  # mm, the height of what is not there
LEVEL = 1e-12  # climb per mm
HALVINGS = 30


@inner
def profile(tools, row, rho):
    """Height of the tool's surface over its tip at distance rho from its axis, mm."""
    kind = tools[row, KIND]
    lift = tools[row, LIFT]
    if kind == FLAT:
        return lift
    if kind == DRILL:
        return lift + rho / tools[row, CONE]
    corner = tools[row, CORNER]
    inside = rho - (tools[row, RADIUS] - corner)
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
def beside(sweeps, k, x, y):
    """Distance of a point from the way of a sweep in the plane, mm."""
    dx = x - sweeps[k, X0]
    dy = y - sweeps[k, Y0]
    s = dx * sweeps[k, UX] + dy * sweeps[k, UY]
    t = min(max(s, 0.0), sweeps[k, LENGTH])
    n = dx * sweeps[k, UY] - dy * sweeps[k, UX]
    if sweeps[k, LENGTH] == 0.0:
        return math.sqrt(dx * dx + dy * dy)
    return math.sqrt(n * n + (s - t) * (s - t))


@inner
def rises(tools, row, climb, aside, along):
    """Whether the tool's surface over a point rises while it goes on; aside, along: from the point to the tool, mm."""
    rho = math.sqrt(aside * aside + along * along)
    return climb + slope(tools, row, rho) * along / max(rho, 1e-12) > 0.0


@inner
def bottom(sweeps, tools, k, slim, x, y):
    """Lowest height of sweep k over a point, mm; NOWHERE where it does not pass. slim: 1 for the slimmer tool."""
    row = 2 * int(sweeps[k, TOOL]) + slim
    radius = tools[row, RADIUS]
    dx = x - sweeps[k, X0]
    dy = y - sweeps[k, Y0]
    length = sweeps[k, LENGTH]
    if length == 0.0:
        square = dx * dx + dy * dy
        if square > radius * radius:
            return NOWHERE
        return min(sweeps[k, Z0], sweeps[k, Z1]) + profile(tools, row, math.sqrt(square))
    n = dx * sweeps[k, UY] - dy * sweeps[k, UX]
    left = radius * radius - n * n
    if left < 0.0:
        return NOWHERE
    s = dx * sweeps[k, UX] + dy * sweeps[k, UY]
    half = math.sqrt(left)
    low = max(0.0, s - half)
    high = min(length, s + half)
    if low > high:
        return NOWHERE
    climb = sweeps[k, CLIMB]
    kind = tools[row, KIND]
    if kind == FLAT:
        return sweeps[k, Z0] + climb * (low if climb >= 0.0 else high) + tools[row, LIFT]
    if abs(climb) < LEVEL:
        t = min(max(s, low), high)
    elif kind == BALL:
        t = min(max(s - climb * half / math.sqrt(1.0 + climb * climb), low), high)
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
    rho = min(math.sqrt(n * n + (t - s) * (t - s)), radius)
    return sweeps[k, Z0] + climb * t + profile(tools, row, rho)
