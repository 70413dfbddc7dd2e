"""Engagement at a tip position that the caller chooses, and removal of one straight sweep.

`cut_legs` chooses the positions along a leg itself. Here the caller does, because the next position of a deflected tip
depends on the force at this one.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import entry
from camcomp.model.stock.along_legs import append_recent, settle_recent
from camcomp.model.stock.measure import measure
from camcomp.model.stock.places import PATH
from camcomp.model.stock.removal import put_sweep


@entry
def meet(nodes, place, found, tip, direction, tool):
    """Measure the engagement at a tip (3,) mm that moves along a direction (3,), and return the number of arcs.

    The arcs go into found.arc_rows, the depth and the sum of the arcs into place.told. Recent sweeps that the field does not
    contain yet count as material.
    """
    size = math.sqrt(direction[0] * direction[0] + direction[1] * direction[1])
    at = place.at
    for i in range(3):
        at[i] = tip[i]
    at[3], at[4], at[5] = direction[0] / size, direction[1] / size, direction[2] / size
    place.row[0] = 2 * tool
    place.many[0] = 0
    return measure(nodes, place, found.arc_rows, 0)


@entry
def take_way(nodes, place, found, start, end, tool, lag):
    """Remove the sweep of the tool between two tip positions (3,) mm from the stock once the tip is `lag` mm farther."""
    k = put_sweep(nodes, start[0], start[1], start[2], end[0], end[1], end[2], tool)
    if k < 0:
        return
    length = math.sqrt((end[0] - start[0]) ** 2 + (end[1] - start[1]) ** 2 + (end[2] - start[2]) ** 2)
    found.way[PATH] += length
    append_recent(nodes, place, found, k, found.way[PATH])
    settle_recent(nodes, place, found, found.way[PATH] - lag)
