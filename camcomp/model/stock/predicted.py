"""Cheap test whether interpolation between two places predicts the engagement between them.

A full measurement of a ball, bull or drill tool evaluates the field at several hundred points. Where both places have
the same arcs, a tenth of the points suffices: two at every predicted edge, and some angles between that change from slice
to slice.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import inner
from camcomp.model.stock.field import ZMIN
from camcomp.model.stock.front import ARC_COLUMNS, AT, EDGE, END_ANGLE, FLOOR, least_angle, meets
from camcomp.model.stock.sweeps import FLAT, KIND, radius_at, slope

OFF, FINEST = 5e-3, 1e-3  # rad: largest tolerance of an edge, and the smallest for which the test is cheaper
BETWEEN, TURN = 4, 8  # number of angles tested per slice, and of slices after which they repeat


@inner
def has_same_arcs(found, a, b):
    """Whether two slots have the same number of arcs in every slice."""
    rows, n = found.arc_rows, found.stack_rows[a, 1]
    first, second = found.stack_rows[a, 0], found.stack_rows[b, 0]
    if n == 0 or n != found.stack_rows[b, 1]:
        return False
    for r in range(1, n):
        same = rows[first + r, AT] == rows[first + r - 1, AT]
        if same != (rows[second + r, AT] == rows[second + r - 1, AT]):
            return False
    return True


@inner
def mix(found, a, b, w):
    """Append the arcs at share w between two slots with the same arcs, and return their first row; counts do not change."""
    rows, first = found.arc_rows, found.told_of[2]
    for r in range(found.stack_rows[a, 1]):
        p, q = found.stack_rows[a, 0] + r, found.stack_rows[b, 0] + r
        for i in range(ARC_COLUMNS):
            rows[first + r, i] = rows[p, i] + w * (rows[q, i] - rows[p, i])
    return first


@inner
def expected(rows, first, last, psi, off):
    """1 for an angle inside an arc of a slice, 0 outside, -1 within `off` (rad) of an edge."""
    for r in range(first, last):
        if rows[r, 0] + off < psi < rows[r, 1] - off:
            return 1
        if rows[r, 0] - off <= psi <= rows[r, 1] + off:
            return -1
    return 0


@inner
def looks_so(nodes, place, found, first, last, radius, run, level, least, number, off):
    """Whether the material at one slice of the tool agrees with its predicted arcs; number: index of the slice."""
    rows = found.arc_rows
    begin, end = least + END_ANGLE, math.pi - least - END_ANGLE
    for r in range(first, last):
        for side in range(2):
            edge, sign = (rows[r, 1], -1.0) if side else (rows[r, 0], 1.0)
            inside, outside = edge + sign * off, edge - sign * off
            if begin < inside < end and not meets(nodes, place, radius, run, level, math.cos(inside), math.sin(inside)):
                return False
            if (
                begin < outside < end
                and expected(rows, first, last, outside, 0.5 * off) == 0
                and meets(nodes, place, radius, run, level, math.cos(outside), math.sin(outside))
            ):
                return False
    for k in range(BETWEEN):
        psi = begin + (k + (number % TURN + 0.5) / TURN) / BETWEEN * (end - begin)
        wanted = expected(rows, first, last, psi, off)
        if wanted >= 0 and meets(nodes, place, radius, run, level, math.cos(psi), math.sin(psi)) != (wanted == 1):
            return False
    return True


@inner
def is_as_predicted(nodes, place, found, a, b, w, missed):
    """Whether the arcs at the present place (place.at) are those at share w between slots a and b.

    missed: tolerance of the engagement, as in places.py. False also where the test cannot decide.
    """
    row, rows = int(place.row[0]), found.arc_rows
    n = found.stack_rows[a, 1]
    if nodes.tools[row, KIND] == FLAT or not has_same_arcs(found, a, b) or found.told_of[2] + n > rows.shape[0]:
        return False
    first = mix(found, a, b, w)
    tall = 0.0
    for r in range(first, first + n):
        if rows[r, 1] - rows[r, 0] <= 0.0:
            return False
        tall += rows[r, 2]
    off = min(OFF, 0.5 * missed / tall)
    if off < FINEST:
        return False
    number, at = 0, first
    while at < first + n:
        behind = at + 1
        while behind < first + n and rows[behind, AT] == rows[at, AT]:
            behind += 1
        lift = rows[at, AT]
        radius = radius_at(nodes.tools, row, lift)
        run = 1.0 / max(slope(nodes.tools, row, radius), 1e-12)
        least = least_angle(place.at[5], run)
        level = max(place.at[2] + lift, nodes.place[ZMIN]) + FLOOR
        if least >= 0.5 * math.pi or radius <= EDGE:
            return False
        if not looks_so(nodes, place, found, at, behind, radius - EDGE, run, level, least, number, off):
            return False
        at, number = behind, number + 1
    return True
