"""The stock under a tool that is led by hand: what it meets at a tip, and a straight way of the tip taken away.

`march` looks for places along a leg by itself; here the caller says where to look, because where the tip goes next depends
on what it meets.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.model.statics.compiled import entry
from camcomp.model.stock.march import push_recent, settle_recent
from camcomp.model.stock.measure import measure
from camcomp.model.stock.places import PATH
from camcomp.model.stock.removal import put_sweep


@entry
def meet(nodes, place, found, tip, direction, tool):
    """What the tool meets at a tip (3,) mm that goes on along a direction (3,): arcs into found.bites; their number.

    Depth and sum of the arcs stand in place.told. What was taken last, and so may still be cut again, counts as standing.
    """
    size = math.sqrt(direction[0] * direction[0] + direction[1] * direction[1])
    at = place.at
    for i in range(3):
        at[i] = tip[i]
    at[3], at[4], at[5] = direction[0] / size, direction[1] / size, direction[2] / size
    place.row[0] = 2 * tool
    place.many[0] = 0
    return measure(nodes, place, found.bites, 0)


@entry
def take_way(nodes, place, found, start, end, tool, lag):
    """Takes away what the tool goes through from tip to tip (3,) mm, as soon as the tip has gone on by lag mm."""
    k = put_sweep(nodes, start[0], start[1], start[2], end[0], end[1], end[2], tool)
    if k < 0:
        return
    length = math.sqrt((end[0] - start[0]) ** 2 + (end[1] - start[1]) ** 2 + (end[2] - start[2]) ** 2)
    found.way[PATH] += length
    push_recent(nodes, place, found, k, found.way[PATH])
    settle_recent(nodes, place, found, found.way[PATH] - lag)
