"""Places on a leg between which the engagement is linear or jumps.

A leg is a straight motion of the tip: a line, or a chord of an arc. Places are added by bisection until the engagement
between neighbours is linear within BENT, or until they are JUMP_MM apart and differ by more than JUMP: a jump.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math
from typing import Any, NamedTuple

from camcomp.ground.compiled import inner
from camcomp.ground.datatypes import Floats
from camcomp.model.stock.front import DEPTH, WHAT, lay_back
from camcomp.model.stock.measure import measure
from camcomp.model.stock.predicted import is_as_predicted

RAPID_LEG, CUT_LEG, PLUNGE_LEG, UNSEEN_LEG = 0, 1, 2, 3
FX, FY, FZ, TX, TY, TZ, AX, AY, BX, BY = range(10)  # of a leg: from, to (mm); directions in the plane at both ends
JUMP_MM = 0.02  # length of a jump: below the usual feed per tooth
JUMP = 0.2  # of the largest engagement: least height of a jump
FINE_MM = 0.0015  # least distance of two places
BENT = 2e-3  # of the largest engagement: tolerance of the linear interpolation
SHORT, CALM = 0.05, 0.02  # shares of the radius and of the engagement below which a leg gets no places between its ends
MOST_RECENT, DEEP = 64, 64
PATH, SCALE = 0, 1  # of `way`: path length (mm), largest engagement so far
RECENT, PLACES, ROWS = range(3)  # of `told_of`
MOST_CHAIN, CHAIN_DEEP = 32, 8  # most short legs of a chain, most of its open intervals
FIRST = DEEP  # first slot of the stack that a chain uses
STEP = 0.5  # of the radius: distance of the first places


class Found(NamedTuple):
    """Places (n,) on legs, their arcs (r,), and the work space of the bisection."""

    leg: Any  # (n,) int64
    u: Floats  # (n,) fraction of the leg
    first: Any  # (n,) int64 row in `arc_rows`
    many: Any  # (n,) int64
    told: Floats  # (n, WHAT) sums of front.py; the last column: largest engagement so far
    arc_rows: Floats  # (r, ARC_COLUMNS)
    crash: Any  # (legs,) bool
    recent_end: Floats  # (MOST_RECENT,) path length at the end of a recent sweep, mm
    way: Floats  # (2,)
    told_of: Any  # (3,) int64, numbers of recent sweeps, places and arcs
    stack_u: Floats  # (DEEP + CHAIN_DEEP,)
    stack: Floats  # (DEEP + CHAIN_DEEP, WHAT)
    stack_rows: Any  # (DEEP + CHAIN_DEEP, 2) int64
    chain_way: Floats  # (MOST_CHAIN + 1,) mm to the ends of short legs
    chain_number: Any  # (CHAIN_DEEP,) int64


@inner
def leg_length(legs, k):
    """Length of leg k, mm."""
    return math.sqrt(
        (legs[k, TX] - legs[k, FX]) ** 2 + (legs[k, TY] - legs[k, FY]) ** 2 + (legs[k, TZ] - legs[k, FZ]) ** 2
    )


@inner
def stand(nodes, place, legs, k, u, many):
    """Move the tool to fraction u of leg k; `many` of the recent sweeps count there."""
    at = place.at
    for i in range(3):
        at[i] = legs[k, FX + i] + u * (legs[k, TX + i] - legs[k, FX + i])
    dx, dy = legs[k, TX] - legs[k, FX], legs[k, TY] - legs[k, FY]
    at[5] = (legs[k, TZ] - legs[k, FZ]) / math.sqrt(dx * dx + dy * dy)
    side = AX if u == 0.0 else BX
    if 0.0 < u < 1.0:
        at[3] = (1.0 - u) * legs[k, AX] + u * legs[k, BX]
        at[4] = (1.0 - u) * legs[k, AY] + u * legs[k, BY]
        size = math.sqrt(at[3] * at[3] + at[4] * at[4])
        at[3] /= size
        at[4] /= size
    else:
        at[3], at[4] = legs[k, side], legs[k, side + 1]
    place.many[0] = many
    lay_back(nodes, place)


@inner
def look(nodes, place, found, legs, k, u, many, slot):
    """Measure the engagement at fraction u of leg k into a slot of the stack."""
    stand(nodes, place, legs, k, u, many)
    rows = found.told_of[ROWS]
    n = measure(nodes, place, found.arc_rows, rows)
    found.told_of[ROWS] = n
    found.stack_u[slot] = u
    found.stack_rows[slot, 0], found.stack_rows[slot, 1] = rows, n - rows
    found.way[SCALE] = max(found.way[SCALE], place.told[0])
    for i in range(WHAT - 1):
        found.stack[slot, i] = place.told[i]
    found.stack[slot, WHAT - 1] = found.way[SCALE]


@inner
def copy_slot(found, a, b):
    """Copy slot a of the stack to slot b."""
    found.stack_u[b] = found.stack_u[a]
    found.stack_rows[b, 0], found.stack_rows[b, 1] = found.stack_rows[a, 0], found.stack_rows[a, 1]
    for i in range(WHAT):
        found.stack[b, i] = found.stack[a, i]


@inner
def put_place(found, k, slot, u, at):
    """Store a slot as place number `at` of the program."""
    found.leg[at] = k
    found.u[at] = u
    found.first[at], found.many[at] = found.stack_rows[slot, 0], found.stack_rows[slot, 1]
    for i in range(WHAT):
        found.told[at, i] = found.stack[slot, i]


@inner
def apart(found, a, b):
    """Largest difference between the integrals of two slots."""
    most = 0.0
    for i in range(DEPTH):
        most = max(most, abs(found.stack[a, i] - found.stack[b, i]))
    return most


@inner
def begins(found, a, b):
    """Whether the tool cuts in exactly one of two slots: there a constant force model switches."""
    return (found.stack[a, 0] > 0.0) != (found.stack[b, 0] > 0.0)


@inner
def bent(found, a, middle, b, w):
    """Error of the linear interpolation at share w between slots a and b for the integrals of the slot `middle`."""
    most = 0.0
    for i in range(DEPTH):
        line = found.stack[a, i] + w * (found.stack[b, i] - found.stack[a, i])
        most = max(most, abs(found.stack[middle, i] - line))
    return most


@inner
def between(nodes, place, found, legs, k, length, radius, before):
    """Store the places between slot 0 and slot 1 of the stack, including that of slot 1."""
    top = 1
    jumped = False
    while top > 0:
        a, b = found.stack_u[0], found.stack_u[top]
        gap = (b - a) * length
        scale = found.way[SCALE]
        differ = apart(found, 0, top)
        room = (
            top + 2 < DEEP
            and found.told_of[PLACES] + 64 < found.leg.shape[0]
            and found.told_of[ROWS] + 1024 < found.arc_rows.shape[0]
        )
        jumps = gap <= JUMP_MM and differ > JUMP * scale
        edge = gap > JUMP_MM and begins(found, 0, top)
        if room and not jumps and gap > FINE_MM and (differ > CALM * scale or gap > SHORT * radius or edge):
            rows = found.told_of[ROWS]
            stand(nodes, place, legs, k, 0.5 * (a + b), before)
            so = is_as_predicted(nodes, place, found, 0, top, 0.5, BENT * scale)
            if not so:
                look(nodes, place, found, legs, k, 0.5 * (a + b), before, top + 1)
            if edge or not so and bent(found, 0, top + 1, top, 0.5) > BENT * scale:
                top += 1
                continue
            found.told_of[ROWS] = rows
        at = found.told_of[PLACES]
        if jumps:
            if a == 0.0 or jumped:  # one jump, at the first of these places
                put_place(found, k, top, found.u[at - 1], at - 1)
                if b == 1.0:
                    put_place(found, k, top, b, at)
                    found.told_of[PLACES] = at + 1
            elif b == 1.0:
                put_place(found, k, 0, b, at)
                found.told_of[PLACES] = at + 1
            else:
                put_place(found, k, 0, b, at)
                put_place(found, k, top, b, at + 1)
                found.told_of[PLACES] = at + 2
        else:
            put_place(found, k, top, b, at)
            found.told_of[PLACES] = at + 1
        jumped = jumps
        copy_slot(found, top, 0)
        top -= 1
