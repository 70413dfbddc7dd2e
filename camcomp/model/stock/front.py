"""The front of a tool at one place of its path, and whether material stands at one angle of it.

Angles count as in camcomp/model/cutting/engagement.py for a clockwise spindle: 0 left of the feed, pi/2 along it, pi
right of it. Material counts on the front half of the tool, where its surface moves towards it, when it is thicker than
EDGE across the tool's axis and stands higher than FLOOR: a finished wall or floor is not cut again because numbers are
rounded. What was taken on the last bit of the way lies against the tool all round its front; such sweeps, `recent`, are
put to the test one by one, with a tool slimmer by EDGE.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math
from typing import Any, NamedTuple

from camcomp.ground.datatypes import Floats
from camcomp.model.statics.compiled import inner
from camcomp.model.stock.field import CELL, ZMIN, above, height
from camcomp.model.stock.sweeps import NOWHERE, TOOL, X0, X1, Y0, Y1, Z0, Z1, bottom, passes

EDGE, FLOOR = 0.002, 0.001  # mm
FEWEST = 16  # angles at which the front of a tool is looked at
TURNS = 8  # halvings of the step between them
NEAR = 1e-4  # mm to which the lowest and highest cut of a tool that is no cylinder are found
END_ANGLE = 1e-3  # rad from the sides of the front half; on less, a wall just cut lies against the tool
# Columns of an arc: entry, exit (rad), height (mm), rise and run of the tool's surface per length of its edge, and where
# it is (AT), mm over the tip.
BITE, AT = 6, 5
DEPTH, ENGAGED, WHAT = 5, 6, 8  # of what is told of a place; in front: five integrals over the engagement


class Place(NamedTuple):
    """Room to work in at a place, and what was found there."""

    at: Floats  # (8,) tip (mm), direction of the feed in the plane, climb per mm; what lay_back notes
    row: Any  # (1,) int64, row of the tool
    recent: Any  # (n,) int64, sweeps that are not cut away yet
    many: Any  # (1,) int64, how many of them count
    told: Floats  # (WHAT,)
    arcs: Floats  # (r, 2) arcs of a place, to be united


@inner
def stands(nodes, place, radius, z, psi):
    """Height of material over z at an angle of the tool's front, mm; 0 when it does not count."""
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
    """At how many angles the front is looked at: two cells apart, and at FEWEST."""
    return max(int(math.pi * radius / (2.0 * nodes.place[CELL])), FEWEST)


@inner
def add_bite(bites, n, start, stop, tall, rise, run, at):
    """Puts down an arc; the number of arcs."""
    if stop <= start or n >= bites.shape[0]:
        return n
    bites[n, 0], bites[n, 1], bites[n, 2], bites[n, 3], bites[n, 4], bites[n, AT] = start, stop, tall, rise, run, at
    return n + 1


@inner
def point_of(place, radius, c, s):
    """Where the tool's front has a radius at an angle with this cosine and sine."""
    ex, ey = place.at[3], place.at[4]
    return place.at[0] + radius * (s * ex - c * ey), place.at[1] + radius * (s * ey + c * ex)


@inner
def lay_back(nodes, place):
    """Notes how far beside and below the tip the ways of the last bit lie, per mm behind it; without bound ahead of it."""
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
    """Sine of the angle of the front beyond which nothing that was taken lies, where the radius grows by `run` per height.

    A tool that stood b mm behind the tip, l beside and d below it, is over a point of the front at psi where
    b sin(psi) <= l + d run, as long as it would not have been so everywhere.
    """
    return place.at[6] + place.at[7] * run


@inner
def taken(nodes, place, x, y, level):
    """Whether what is not cut away yet, but taken, is as low as a level over a point."""
    for r in range(place.many[0]):
        if passes(nodes.sweeps, nodes.tools, place.recent[r], 1, x, y, level):
            return True
    return False


@inner
def meets(nodes, place, radius, run, level, c, s):
    """Whether material stands higher than a level at an angle of the tool's front, whose radius grows by `run` per height."""
    x, y = point_of(place, radius, c, s)
    return above(nodes, x, y, level) and (s > reach_back(place, run) or not taken(nodes, place, x, y, level))


@inner
def least_angle(climb, run):
    """From which angle on a surface with this run per rise moves towards what is in front of it, on a climbing way."""
    if climb <= 0.0:
        return 0.0
    sine = climb * run
    return math.asin(sine) if sine < 1.0 else 0.5 * math.pi
