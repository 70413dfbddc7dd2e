"""Merging of consecutive lines that are straight within a tolerance, as controllers do, compiled."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import numpy as np

from camcomp.ground.compiled import entry

MOST = 100  # most lines of a segment


@entry
def merge(start, end, goes, waits, joins, feed, tolerance, group, first, last):
    """Fill group (n,) with the segment of every move, and return the number of segments.

    A line joins the segment before it while the ends of all its lines stay within the tolerance of the straight line from
    the segment's start to the new end.

    Shapes and units:
        start, end: (n, 3) mm.
        goes: (n,) moves with a length; standstills belong to the segment before them.
        waits: (n,) moves that start from a stop.
        joins: (n,) lines that may be merged.
        feed: (n,) feed in force; a change starts a new segment.
        tolerance: (n,) mm, 0: never.
        group: (n,) filled.
        first, last: (n,) filled with the first and the last move of every segment.
    """
    segment = -1
    before = -1  # the last move with a length
    ends = 0  # number of lines in the segment
    for i in range(end.shape[0]):
        if not goes[i]:
            group[i] = max(segment, 0)
            continue
        fits = (
            before >= 0 and not waits[i] and joins[i] and joins[before] and tolerance[i] > 0.0 and tolerance[i] == tolerance[before]
            and feed[i] == feed[before] and ends <= MOST
        )  # fmt: skip
        if fits:
            begin = first[segment]
            bx, by, bz = start[begin, 0], start[begin, 1], start[begin, 2]
            mx, my, mz = end[i, 0] - bx, end[i, 1] - by, end[i, 2] - bz
            square = mx * mx + my * my + mz * mz
            allowed = tolerance[i] * tolerance[i]
            k = before
            while fits and k >= begin:
                px, py, pz = end[k, 0] - bx, end[k, 1] - by, end[k, 2] - bz
                t = (mx * px + my * py + mz * pz) / square if square > 0.0 else 0.0
                t = min(max(t, 0.0), 1.0)
                px, py, pz = px - t * mx, py - t * my, pz - t * mz
                fits = px * px + py * py + pz * pz <= allowed
                k -= 1
        if not fits:
            segment += 1
            ends = 0
            first[segment] = i
        ends += 1
        last[segment] = i
        group[i] = segment
        before = i
    return segment + 1


@entry
def straight(start, end, nominal, way, most):
    """Fill length nominal (n,) mm, unit direction way (n, 3) of lines, and most (n,): 1 / its largest component."""
    for i in range(end.shape[0]):
        x, y, z = end[i, 0] - start[i, 0], end[i, 1] - start[i, 1], end[i, 2] - start[i, 2]
        size = np.sqrt(x * x + y * y + z * z)
        nominal[i] = size
        share = 1.0 / size if size > 0.0 else 0.0
        way[i, 0], way[i, 1], way[i, 2] = x * share, y * share, z * share
        most[i] = size / max(abs(x), abs(y), abs(z)) if size > 0.0 else 1.0
