"""Material at an angle of the front of a tool.

Angles count as in camcomp/model/cutting/engagement.py for a clockwise spindle: 0 left of the feed, pi/2 along it, pi
right of it. Material counts on the front half of the tool, where its surface moves towards it, if it is thicker than
EDGE across the tool's axis and higher than FLOOR: rounding does not cut a finished wall or floor again. The latest sweeps
lie against the tool all round its front; these, `recent`, are evaluated one by one with a tool slimmer by EDGE.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math
from typing import Any, NamedTuple

from camcomp.ground.compiled import inner
from camcomp.ground.datatypes import Floats
from camcomp.model.stock.field import CELL, ZMIN, above, height
from camcomp.model.stock.sweeps import NOWHERE, TOOL, X0, X1, Y0, Y1, Z0, Z1, bottom, passes

EDGE, FLOOR = 0.002, 0.001  # mm
FEWEST = 16  # least number of sampled angles of the front
TURNS = 8  # halvings of the step between them
NEAR = 1e-4  # mm, accuracy of the lowest and the highest cut of a ball, bull or drill tool
END_ANGLE = 1e-3  # rad from the sides of the front half; within it, a wall just cut lies against the tool
# Columns of an arc: entry, exit (rad), height (mm), rise and run of the tool's surface per length of its edge, height
# over the tip (AT, mm).
ARC_COLUMNS, AT = 6, 5
# Columns of the sums of a place, and their number; columns 0 to 4 are integrals over the arcs.
DEPTH, ENGAGED, WHAT = 5, 6, 8


class Place(NamedTuple):
    """Work space of a measurement at one place, and its sums."""

    at: Floats  # (8,) tip (mm), direction of the feed in the plane, climb per mm; slopes from lay_back
    row: Any  # (1,) int64, row of the tool
    recent: Any  # (n,) int64, sweeps that the field does not contain yet
    many: Any  # (1,) int64, number of them that count here
    told: Floats  # (WHAT,) sums
    arcs: Floats  # (r, 2) arcs of a place, to be united


@inner
def stands(nodes, place, radius, z, psi):
    """Height of the material over z at an angle of the tool's front, mm; 0 where it does not count."""
    ex, ey = place.at[3], place.at[4]
    c, s = math.cos(psi), math.sin(psi)
    x = place.at[0] + radius * (s * ex - c * ey)
    y = place.at[1] + radius * (s * ey + c * ex)
    floor = max(z, nodes.place[ZMIN])
    top = height(nodes, x, y, floor + FLOOR)
    for r in range(place.many[0] if s <= reach_back(place, 0.0) else 0):
        if top <= floor + FLOOR:
            return 0.0
        top = min(top, bottom(nodes.sweeps, nodes.tools, place.recent[r], 1, x, y))
    return top - floor if top > floor + FLOOR else 0.0


@inner
def angles_of(nodes, radius):
    """Number of sampled angles of the front: two cells apart, at least FEWEST."""
    return max(int(math.pi * radius / (2.0 * nodes.place[CELL])), FEWEST)


@inner
def add_arc(arc_rows, n, start, stop, tall, rise, run, at):
    """Append an arc, and return the new number of arcs."""
    if stop <= start or n >= arc_rows.shape[0]:
        return n
    arc_rows[n, 0], arc_rows[n, 1], arc_rows[n, 2], arc_rows[n, 3], arc_rows[n, 4], arc_rows[n, AT] = (
        start,
        stop,
        tall,
        rise,
        run,
        at,
    )
    return n + 1


@inner
def point_of(place, radius, c, s):
    """Position (x, y) mm of the tool's front at a radius (mm) and the angle with this cosine and sine."""
    ex, ey = place.at[3], place.at[4]
    return place.at[0] + radius * (s * ex - c * ey), place.at[1] + radius * (s * ey + c * ex)


@inner
def lay_back(nodes, place):
    """Store the largest lateral and downward offset of the recent sweeps from the tip, per mm behind it.

    Both go into place.at; NOWHERE if a recent sweep reaches ahead of the tip.
    """
    at = place.at
    aside = below = 0.0
    for r in range(place.many[0]):
        k = place.recent[r]
        if 2 * int(nodes.sweeps[k, TOOL]) != place.row[0]:
            aside = NOWHERE
        for end in range(2):
            dx = nodes.sweeps[k, X1 if end else X0] - at[0]
            dy = nodes.sweeps[k, Y1 if end else Y0] - at[1]
            if dx * dx + dy * dy < NEAR * NEAR:
                continue
            back = -(dx * at[3] + dy * at[4])
            if back <= 0.0:
                aside = NOWHERE
                continue
            aside = max(aside, abs(dx * at[4] - dy * at[3]) / back)
            below = max(below, (at[2] - nodes.sweeps[k, Z1 if end else Z0]) / back)
    at[6], at[7] = aside, below


@inner
def reach_back(place, run):
    """Sine of the angle of the front beyond which the recent sweeps do not reach; the radius grows by `run` per height.

    A tool b mm behind the tip, l to its side and d below it covers a point of the front at psi where
    b sin(psi) <= l + d run.
    """
    return place.at[6] + place.at[7] * run


@inner
def taken(nodes, place, x, y, level):
    """Whether a recent sweep removes the material over a point down to a level (mm)."""
    for r in range(place.many[0]):
        if passes(nodes.sweeps, nodes.tools, place.recent[r], 1, x, y, level):
            return True
    return False


@inner
def meets(nodes, place, radius, run, level, c, s):
    """Whether the material is higher than a level at an angle of the tool's front; the radius grows by `run` per height."""
    x, y = point_of(place, radius, c, s)
    return above(nodes, x, y, level) and (s > reach_back(place, run) or not taken(nodes, place, x, y, level))


@inner
def least_angle(climb, run):
    """Smallest angle (rad) from which a surface with this run per rise moves towards the material on a climbing path."""
    if climb <= 0.0:
        return 0.0
    sine = climb * run
    return math.asin(sine) if sine < 1.0 else 0.5 * math.pi
