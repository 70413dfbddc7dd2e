"""Which pieces of a path go on smoothly from the piece before, and the load that both share at such a corner; compiled."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import entry
from camcomp.model.statics.vectors import dot, part, plus

SAME_FORCE = 1e-6  # of the force: lengths of the path are rounded sums, and a table is looked up by them
NO_FORCE = 1e-9  # N


@entry
def find_corners(rapid, length, cutting, over, first, last, join_cosine, before, corner, smooth, bisector):
    """Fills in for pieces (p,) the piece before that has a length or is a rapid (-1: none), stops and smooth corners.

    first, last (p, 3): directions at the ends. over (p,): the direction across the tool reverses at the start. Fills
    corner (p,), smooth (p,) and bisector (p, 3), the common direction of a smooth corner, else zero.
    """
    previous = -1
    for b in range(length.shape[0]):
        before[b], corner[b], smooth[b] = -1, True, False
        bisector[b, 0] = bisector[b, 1] = bisector[b, 2] = 0.0
        if not (length[b] > 0.0 or rapid[b]):
            continue
        a, previous = previous, b
        before[b] = a
        if a < 0 or rapid[a] or rapid[b]:
            continue
        u, v = part(last[a], 0), part(first[b], 0)
        if not dot(u, v) >= join_cosine:
            continue
        corner[b] = False
        if cutting[a] and cutting[b] and not over[b]:
            smooth[b] = True
            middle = plus(u, v, 1.0)
            size = math.sqrt(dot(middle, middle))
            for k in range(3):
                bisector[b, k] = middle[k] / size


@entry
def share_loads(rapid, length, before, smooth, own0, own1, ahead, behind, fade0, fade1, jump):
    """Fills in fade0, fade1 (p, 3), what the corners' loads add at both ends, and where the force jumps (p,).

    own0, own1 (p, 3): forces at the ends. ahead, behind (p, 3): of both sides of the corner at the start, along its
    bisector. Pieces without a length keep the force of the piece before them.
    """
    for b in range(length.shape[0]):
        for k in range(3):
            fade0[b, k] = fade1[b, k] = 0.0
    for b in range(length.shape[0]):
        jump[b] = False
        if not (length[b] > 0.0 or rapid[b]):
            continue
        a, begin = before[b], part(own0[b], 0)
        if a < 0:
            jump[b] = b > 0 and math.sqrt(dot(begin, begin)) > NO_FORCE
            continue
        u, v = part(ahead[b], 0), part(behind[b], 0)
        off = plus(v, u, -1.0)
        if smooth[b] and math.sqrt(dot(off, off)) <= SAME_FORCE * math.sqrt(dot(u, u)) + NO_FORCE:
            for k in range(3):
                shared = 0.5 * (u[k] + v[k])
                fade1[a, k], fade0[b, k] = shared - own1[a, k], shared - own0[b, k]
        else:
            off = plus(begin, part(own1[a], 0), -1.0)
            jump[b] = math.sqrt(dot(off, off)) > NO_FORCE
    a = -1
    for b in range(length.shape[0]):
        if length[b] > 0.0 or rapid[b]:
            a = b
        elif a >= 0:
            for k in range(3):
                fade0[b, k] = fade1[b, k] = own1[a, k] + fade1[a, k]
