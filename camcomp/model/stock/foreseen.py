"""Whether the engagement between two places is what lies between theirs, without measuring it.

A tool that is no cylinder is asked at several hundred points to find all of its arcs. Where they are known on both sides
and are the same ones, a tenth of that tells whether they lie where they are foreseen: on both sides of every edge, and at
angles in between that change from slice to slice.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.model.statics.compiled import inner
from camcomp.model.stock.field import ZMIN
from camcomp.model.stock.front import AT, BITE, EDGE, END_ANGLE, FLOOR, least_angle, meets
from camcomp.model.stock.sweeps import FLAT, KIND, radius_at, slope

OFF, FINEST = 5e-3, 1e-3  # rad by which an edge may be elsewhere at most, and what is worth looking for
BETWEEN, TURN = 4, 8  # angles at which a slice is looked at, and after how many slices they come again


@inner
def alike(found, a, b):
    """Whether the arcs in two slots are the same ones, slice by slice."""
    rows, n = found.bites, found.stack_rows[a, 1]
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
    """Arcs at share w between two slots with the same ones, behind all others; told_of is left as it is. Their first row."""
    rows, first = found.bites, found.told_of[2]
    for r in range(found.stack_rows[a, 1]):
        p, q = found.stack_rows[a, 0] + r, found.stack_rows[b, 0] + r
        for i in range(BITE):
            rows[first + r, i] = rows[p, i] + w * (rows[q, i] - rows[p, i])
    return first


@inner
def expected(rows, first, last, psi, off):
    """Whether an angle lies in an arc (1) or in none (0) of a slice; -1: next to an edge."""
    for r in range(first, last):
        if rows[r, 0] + off < psi < rows[r, 1] - off:
            return 1
        if rows[r, 0] - off <= psi <= rows[r, 1] + off:
            return -1
    return 0


@inner
def looks_so(nodes, place, found, first, last, radius, run, level, least, number, off):
    """Whether one slice is as foreseen; number: which one it is."""
    rows = found.bites
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
def as_foreseen(nodes, place, found, a, b, w, missed):
    """Whether the arcs where the tool stands now (place.at) are those at share w between slots a and b.

    missed: by how much the engagement may be off, as in places.py. False also where that is not known.
    """
    row, rows = int(place.row[0]), found.bites
    n = found.stack_rows[a, 1]
    if nodes.tools[row, KIND] == FLAT or not alike(found, a, b) or found.told_of[2] + n > rows.shape[0]:
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
