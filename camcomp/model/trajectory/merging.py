"""Lines that a control makes one of because they are straight within a tolerance, compiled."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import numpy as np

from camcomp.model.statics.compiled import entry

MOST = 100  # ends that a control keeps in mind; the line behind them begins a new one


@entry
def merge(start, end, goes, waits, joins, feed, tolerance, group, first, last):
    """Numbers the segments that moves (n,) become, group (n,); the number of segments.

    A line joins the segment in front of it while the ends of all lines in it stay within the tolerance of the straight
    way from the segment's start to the new end. start, end (n, 3) mm. goes (n,): moves that are no standstill; the
    others count to the segment in front of them. waits (n,): moves that begin at rest. joins (n,): lines that may be joined. feed (n,) in force: another
    one begins a new segment. tolerance (n,) mm: 0 for never. first, last (n,) are filled with the moves at the
    begin and at the end of every segment.
    """
    segment = -1
    before = -1  # the move before that went somewhere
    ends = 0  # of lines in the segment
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
    """Fills length nominal (n,) mm and unit direction way (n, 3) of lines; most (n,): 1 / the largest of its components."""
    for i in range(end.shape[0]):
        x, y, z = end[i, 0] - start[i, 0], end[i, 1] - start[i, 1], end[i, 2] - start[i, 2]
        size = np.sqrt(x * x + y * y + z * z)
        nominal[i] = size
        share = 1.0 / size if size > 0.0 else 0.0
        way[i, 0], way[i, 1], way[i, 2] = x * share, y * share, z * share
        most[i] = size / max(abs(x), abs(y), abs(z)) if size > 0.0 else 1.0
