"""Engagement arcs of a cylindrical tool, each with the mean height of the material in it."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import inner
from camcomp.model.stock.front import DEPTH, EDGE, END_ANGLE, TURNS, add_arc, angles_of, stands

ASIDE = 0.02  # share of the step between two angles: distance from an edge


@inner
def edge_between(nodes, place, radius, z, a, b, level):
    """Angle between a and b (rad) at which the height of the material over z crosses `level` (mm), by bisection."""
    above = stands(nodes, place, radius, z, a) > level
    for _ in range(TURNS):
        middle = 0.5 * (a + b)
        if (stands(nodes, place, radius, z, middle) > level) == above:
            a = middle
        else:
            b = middle
    return 0.5 * (a + b)


@inner
def step_next_to(nodes, place, radius, z, edge, psi, here):
    """Angle between an edge and psi at which the height of the material steps to `here` (mm), and its height before."""
    first = edge + ASIDE * (psi - edge)
    high = stands(nodes, place, radius, z, first)
    if high <= 0.0 or abs(high - here) <= 2.0 * EDGE + 0.02 * max(high, here):
        return edge, 0.0
    return edge_between(nodes, place, radius, z, first, psi, 0.5 * (high + here)), high


@inner
def look_round(nodes, place, arc_rows, n, radius, z):
    """Append the engagement arcs of a cylinder to `arc_rows` from row n on, and return the new number of rows."""
    count = angles_of(nodes, radius)
    begin, end = END_ANGLE, math.pi - END_ANGLE
    start, top, sum_, members = -1.0, 0.0, 0.0, 0
    before, last = 0.0, begin
    for k in range(count + 2):
        psi = end if k == count + 1 else (begin if k == 0 else begin + (k - 0.5) / count * (end - begin))
        now = stands(nodes, place, radius, z, psi)
        mean = sum_ / members if members > 0 else 0.0  # a slope becomes several arcs
        same = abs(now - mean) <= 2.0 * EDGE + 0.02 * max(now, mean)
        if k == 0:
            if now > 0.0:
                start, sum_, members = 0.0, now, 1
        elif same and (now > 0.0) == (before > 0.0):
            if now > 0.0:
                sum_ += now
                members += 1
        else:
            both = min(now, before) > 0.0
            at = edge_between(nodes, place, radius, z, last, psi, 0.5 * (now + before) if both else 0.0)
            if before > 0.0:
                step, high = at, 0.0
                if not both:
                    step, high = step_next_to(nodes, place, radius, z, at, last, before)
                n = add_arc(arc_rows, n, start, step, sum_ / members, 1.0, 0.0, 0.0)
                n = add_arc(arc_rows, n, step, at, high, 1.0, 0.0, 0.0)
                top = max(top, high)
            start, sum_, members = at, now, 1
            if now > 0.0 and not both:
                start, high = step_next_to(nodes, place, radius, z, at, psi, now)
                n = add_arc(arc_rows, n, at, start, high, 1.0, 0.0, 0.0)
                top = max(top, high)
        top = max(top, now)
        before, last = now, psi
    if before > 0.0:
        n = add_arc(arc_rows, n, start, math.pi, sum_ / members, 1.0, 0.0, 0.0)
    place.told[DEPTH] = max(place.told[DEPTH], top)
    return n
