"""Engagement along a chain of short legs without corners.

The engagement is measured at a few ends of legs only, where it is linear along the chain (bisection until the error of
the linear interpolation is below BENT).
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import inner
from camcomp.model.stock.front import ARC_COLUMNS, WHAT
from camcomp.model.stock.places import (
    BENT,
    CALM,
    CUT_LEG,
    FIRST,
    MOST_CHAIN,
    MOST_RECENT,
    PLACES,
    RECENT,
    ROWS,
    SCALE,
    SHORT,
    STEP,
    apart,
    begins,
    bent,
    between,
    copy_slot,
    leg_length,
    look,
    put_place,
    stand,
)
from camcomp.model.stock.predicted import has_same_arcs, is_as_predicted, mix


@inner
def blend(found, a, b, w, out):
    """Interpolate the engagement linearly at share w between slots a and b into slot `out`."""
    first, rows = found.told_of[ROWS], found.arc_rows
    for i in range(WHAT):
        found.stack[out, i] = found.stack[a, i] + w * (found.stack[b, i] - found.stack[a, i])
    if apart(found, a, b) <= BENT * found.way[SCALE]:
        found.stack_rows[out, 0], found.stack_rows[out, 1] = found.stack_rows[a, 0], found.stack_rows[a, 1]
        return
    if has_same_arcs(found, a, b):
        found.stack_rows[out, 0], found.stack_rows[out, 1] = mix(found, a, b, w), found.stack_rows[a, 1]
        found.told_of[ROWS] = first + found.stack_rows[a, 1]
        return
    n = first
    for side in range(2):
        slot = b if side else a
        share = w if side else 1.0 - w
        for r in range(found.stack_rows[slot, 0], found.stack_rows[slot, 0] + found.stack_rows[slot, 1]):
            for i in range(ARC_COLUMNS):
                rows[n, i] = rows[r, i]
            rows[n, 2] *= share  # the force goes with the height
            n += 1
    found.stack_rows[out, 0], found.stack_rows[out, 1] = first, n - first
    found.told_of[ROWS] = n


@inner
def put_straight(found, k, a, b, slot_a, slot_b):
    """Store the places of short legs k + a to k + b - 1, interpolated between two slots."""
    ends, at = found.chain_way, found.told_of[PLACES]
    copy_slot(found, slot_a, 0)
    for j in range(a, b):
        put_place(found, k + j, 0, 0.0, at)
        if j + 1 == b:
            copy_slot(found, slot_b, 0)
        else:
            blend(found, slot_a, slot_b, (ends[j + 1] - ends[a]) / (ends[b] - ends[a]), 0)
        put_place(found, k + j, 0, 1.0, at + 1)
        at += 2
    found.told_of[PLACES] = at


@inner
def is_predicted_between(nodes, place, found, legs, k, a, b, slot_a, slot_b, radius, before):
    """Whether interpolation predicts the engagement at the ends of short legs k + a to k + b - 2."""
    ends = found.chain_way
    gap = ends[b] - ends[a]
    parts = max(math.ceil(gap / (0.5 * STEP * radius)), 2)
    last = a
    for j in range(a + 1, b):
        if ends[j] - ends[last] < 0.9 * gap / parts:
            continue
        last = j
        stand(nodes, place, legs, k + j - 1, 1.0, before + j)
        if not is_as_predicted(nodes, place, found, slot_a, slot_b, (ends[j] - ends[a]) / gap, BENT * found.way[SCALE]):
            return False
    return True


@inner
def along_chain(nodes, place, found, legs, k, count, radius, before, joined_on):
    """Store the places of a chain of short legs; slot FIRST holds the engagement at its start."""
    ends, number = found.chain_way, found.chain_number
    look(nodes, place, found, legs, k + count - 1, 1.0, before + count - (0 if joined_on else 1), FIRST + 1)
    number[0], number[1] = 0, count
    top = 1
    while top > 0:
        a, b, slot = number[0], number[top], FIRST + top
        gap, scale = ends[b] - ends[a], found.way[SCALE]
        if b - a == 1:
            copy_slot(found, FIRST, 0)
            copy_slot(found, slot, 1)
            found.stack_u[0] = 0.0  # the end of the leg before
            put_place(found, k + a, 0, 0.0, found.told_of[PLACES])
            found.told_of[PLACES] += 1
            between(nodes, place, found, legs, k + a, gap, radius, before + a)
        elif gap > SHORT * radius or apart(found, FIRST, slot) > CALM * scale or begins(found, FIRST, slot):
            m = (a + b) // 2
            if is_predicted_between(nodes, place, found, legs, k, a, b, FIRST, slot, radius, before):
                put_straight(found, k, a, b, FIRST, slot)
                copy_slot(found, slot, FIRST)
                number[0] = b
                top -= 1
                continue
            look(nodes, place, found, legs, k + m - 1, 1.0, before + m, slot + 1)
            off = bent(found, FIRST, slot + 1, slot, (ends[m] - ends[a]) / gap)
            if off > BENT * scale or gap > STEP * radius or begins(found, FIRST, slot):
                top += 1
                number[top] = m
                continue
            put_straight(found, k, a, m, FIRST, slot + 1)
            put_straight(found, k, m, b, slot + 1, slot)
        else:
            put_straight(found, k, a, b, FIRST, slot)
        copy_slot(found, slot, FIRST)
        number[0] = b
        top -= 1


@inner
def chain_from(found, kind, legs, joined, leg, most_way, lately):
    """Number of short legs from `leg` on without a corner between them, at most most_way mm long in all.

    Fills found.chain_way with the path length (mm) to their ends.
    """
    ends, count = found.chain_way, 0
    most = min(MOST_CHAIN, MOST_RECENT - found.told_of[RECENT] - 2)
    ends[0] = 0.0
    while (
        count < most
        and leg + count < kind.shape[0]
        and kind[leg + count] == CUT_LEG
        and (count == 0 or joined[leg + count])
    ):
        k = leg + count
        length = leg_length(legs, k)
        if not 0.0 < length < 3.0 * lately or ends[count] + length > most_way:
            break
        count += 1
        ends[count] = ends[count - 1] + length
    return count
