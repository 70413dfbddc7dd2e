"""Engagement at one place: arcs of the tool's turn, with the height of the tool that cuts in each."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import inner
from camcomp.model.stock.cylinders import look_round
from camcomp.model.stock.field import XMAX, XMIN, YMAX, YMIN, ZMAX
from camcomp.model.stock.front import EDGE, ENGAGED, FLOOR, WHAT
from camcomp.model.stock.slices import look_over
from camcomp.model.stock.sweeps import FLAT, KIND, RADIUS


@inner
def sum_up(place, arc_rows, first, n):
    """Sum integrals over the arcs from row `first` on, and the angle (rad) of their union, for the place.

    Columns 0 to 4: integrals of h, h sin, h cos, h cos 2psi, h sin 2psi over psi, h: height of the tool that cuts, mm.
    """
    told, arcs, k = place.told, place.arcs, 0
    for r in range(first, n):
        start, stop, tall = arc_rows[r, 0], arc_rows[r, 1], arc_rows[r, 2]
        told[0] += tall * (stop - start)
        told[1] += tall * (math.cos(start) - math.cos(stop))
        told[2] += tall * (math.sin(stop) - math.sin(start))
        told[3] += tall * 0.5 * (math.sin(2.0 * stop) - math.sin(2.0 * start))
        told[4] += tall * 0.5 * (math.cos(2.0 * start) - math.cos(2.0 * stop))
        if k == arcs.shape[0]:
            continue
        j = k - 1
        while j >= 0 and arcs[j, 0] > start:  # few, and mostly in order
            arcs[j + 1, 0], arcs[j + 1, 1] = arcs[j, 0], arcs[j, 1]
            j -= 1
        arcs[j + 1, 0], arcs[j + 1, 1] = start, stop
        k += 1
    reach = -1.0
    for i in range(k):
        told[ENGAGED] += max(arcs[i, 1] - max(arcs[i, 0], reach), 0.0)
        reach = max(reach, arcs[i, 1])


@inner
def measure(nodes, place, arc_rows, n):
    """Measure the engagement at a place: sums into the place, arcs into `arc_rows`; return the new number of arcs."""
    told = place.told
    for k in range(WHAT):
        told[k] = 0.0
    row, bounds = int(place.row[0]), nodes.place
    radius, z = nodes.tools[row, RADIUS], place.at[2]
    if z >= bounds[ZMAX] - FLOOR:
        return n
    x, y = place.at[0], place.at[1]
    if x < bounds[XMIN] - radius or x > bounds[XMAX] + radius or y < bounds[YMIN] - radius or y > bounds[YMAX] + radius:
        return n
    first = n
    if nodes.tools[row, KIND] == FLAT:
        n = look_round(nodes, place, arc_rows, n, radius - EDGE, z)
    else:
        n = look_over(nodes, place, arc_rows, n, row)
    sum_up(place, arc_rows, first, n)
    return n
