"""Along the program, leg by leg: what the tool meets at places that lie as close as the engagement asks for, and then the cut.

A leg is a straight way of the tip: a line, or a chord of an arc. Places are added until the engagement between two of
them is a straight line, or until they are JUMP_MM apart and it still differs by much: there it jumps.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math
from typing import Any, NamedTuple

from camcomp.ground.datatypes import Floats
from camcomp.model.statics.compiled import entry, inner
from camcomp.model.stock.field import FREE, USED, cut_away, drop_one, hits, put_sweep
from camcomp.model.stock.measure import DEPTH, EDGE, WHAT, measure
from camcomp.model.stock.sweeps import RADIUS

RAPID_LEG, CUT_LEG, PLUNGE_LEG, UNSEEN_LEG = 0, 1, 2, 3
FX, FY, FZ, TX, TY, TZ, AX, AY, BX, BY = range(10)  # of a leg: from, to (mm); directions in the plane at both ends
JUMP_MM = 0.02  # less than a tooth goes on in a turn
JUMP = 0.2  # of the largest engagement: a steep rise by less is no jump
FINE_MM = 0.0015  # places are no closer than that
BENT = 2e-3  # of it: what a straight line between two places may miss
SHORT, CALM = 0.05, 0.02  # a leg of this share of the radius whose ends differ by this share is not looked at between
STEP = 0.5  # of the radius: places at first
LATELY = 1.5  # times the way on which a sweep lies against the front of the tool by less than EDGE
MOST_RECENT, DEEP = 64, 64
ROOM_FOR_PLACES, ROOM_FOR_ARCS = 4096, 65536  # that a leg may take up
PATH, SCALE = 0, 1  # of `way`: mm gone, largest engagement so far
RECENT, PLACES, ROWS = range(3)  # of `told`


class Found(NamedTuple):
    """Places (n,) found on legs, and their arcs."""

    leg: Any  # (n,) int64
    u: Floats  # (n,) fraction of the leg
    first: Any  # (n,) int64 row in `bites`
    many: Any  # (n,) int64
    told: Floats  # (n, WHAT), the last one: largest engagement so far
    bites: Floats  # (r, BITE)
    crash: Any  # (legs,) bool
    recent_end: Floats  # (MOST_RECENT,) mm of the way
    way: Floats  # (2,)
    told_of: Any  # (3,) int64
    stack_u: Floats  # (DEEP,)
    stack: Floats  # (DEEP, WHAT)
    stack_rows: Any  # (DEEP, 2) int64


@inner
def settle_recent(nodes, place, found, until):
    """Cuts away what was taken before `until` mm of the way."""
    n = int(found.told_of[RECENT])
    done = 0
    while done < n and found.recent_end[done] <= until:
        cut_away(nodes, place.recent[done])
        done += 1
    for k in range(done, n):
        place.recent[k - done] = place.recent[k]
        found.recent_end[k - done] = found.recent_end[k]
    found.told_of[RECENT] = n - done


@inner
def push_recent(nodes, place, found, k, end):
    """Puts a sweep behind the others; when there are too many the oldest is cut away."""
    if found.told_of[RECENT] == MOST_RECENT:
        settle_recent(nodes, place, found, found.recent_end[0])
    n = found.told_of[RECENT]
    place.recent[n] = k
    found.recent_end[n] = end
    found.told_of[RECENT] = n + 1


@inner
def look(nodes, place, found, legs, k, u, many, slot):
    """Measures at fraction u of leg k into a slot of the stack."""
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
    rows = found.told_of[ROWS]
    n = measure(nodes, place, found.bites, rows)
    found.told_of[ROWS] = n
    found.stack_u[slot] = u
    found.stack_rows[slot, 0], found.stack_rows[slot, 1] = rows, n - rows
    found.way[SCALE] = max(found.way[SCALE], place.told[0])
    for i in range(WHAT - 1):
        found.stack[slot, i] = place.told[i]
    found.stack[slot, WHAT - 1] = found.way[SCALE]


@inner
def copy_slot(found, a, b):
    """Copies slot a of the stack to slot b."""
    found.stack_u[b] = found.stack_u[a]
    found.stack_rows[b, 0], found.stack_rows[b, 1] = found.stack_rows[a, 0], found.stack_rows[a, 1]
    for i in range(WHAT):
        found.stack[b, i] = found.stack[a, i]


@inner
def put_place(found, k, slot, u, at):
    """Writes a slot down as place number `at` of the program."""
    found.leg[at] = k
    found.u[at] = u
    found.first[at], found.many[at] = found.stack_rows[slot, 0], found.stack_rows[slot, 1]
    for i in range(WHAT):
        found.told[at, i] = found.stack[slot, i]


@inner
def apart(found, a, b):
    """How much the engagement in two slots differs."""
    most = 0.0
    for i in range(DEPTH):
        most = max(most, abs(found.stack[a, i] - found.stack[b, i]))
    return most


@inner
def bent(found, a, middle, b):
    """How far the engagement in the slot `middle` is from the mean of its neighbours."""
    most = 0.0
    for i in range(DEPTH):
        most = max(most, abs(found.stack[middle, i] - 0.5 * (found.stack[a, i] + found.stack[b, i])))
    return most


@inner
def between(nodes, place, found, legs, k, length, radius, before):
    """Puts down the places behind slot 0 up to slot 1, which is the last one put on the stack."""
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
            and found.told_of[ROWS] + 1024 < found.bites.shape[0]
        )
        jumps = gap <= JUMP_MM and differ > JUMP * scale
        if room and not jumps and gap > FINE_MM and (differ > CALM * scale or gap > SHORT * radius):
            rows = found.told_of[ROWS]
            look(nodes, place, found, legs, k, 0.5 * (a + b), before, top + 1)
            if bent(found, 0, top + 1, top) > BENT * scale:
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


@inner
def take(nodes, place, found, legs, k, tool, length, lately):
    """Puts the sweep of a leg behind the others, its end apart when it is long; the number of sweeps."""
    end = found.way[PATH] + length
    ax, ay, az, bx, by, bz = legs[k, FX], legs[k, FY], legs[k, FZ], legs[k, TX], legs[k, TY], legs[k, TZ]
    if length < 3.0 * lately:
        push_recent(nodes, place, found, put_sweep(nodes, ax, ay, az, bx, by, bz, tool), end)
        return 1
    u = 1.0 - lately / length
    mx, my, mz = ax + u * (bx - ax), ay + u * (by - ay), az + u * (bz - az)
    push_recent(nodes, place, found, put_sweep(nodes, ax, ay, az, mx, my, mz, tool), end - lately)
    push_recent(nodes, place, found, put_sweep(nodes, mx, my, mz, bx, by, bz, tool), end)
    return 2


@entry
def march(nodes, place, found, kind, legs, tool, joined, leg):
    """Goes on from leg number `leg`; the leg before which it stopped because there was no more room.

    kind (m,): what a leg is. legs (m, 10). tool (m,). joined (m + 1,): the leg goes on from the one before without a
    corner, so that both see the same at the point between them.
    """
    m = kind.shape[0]
    while leg < m:
        k = leg
        counts = nodes.counts
        if (
            counts[FREE] + nodes.sweeps.shape[0] - counts[USED] < 4
            or found.told_of[PLACES] + ROOM_FOR_PLACES > found.leg.shape[0]
            or found.told_of[ROWS] + ROOM_FOR_ARCS > found.bites.shape[0]
        ):
            return leg
        length = math.sqrt(
            (legs[k, TX] - legs[k, FX]) ** 2 + (legs[k, TY] - legs[k, FY]) ** 2 + (legs[k, TZ] - legs[k, FZ]) ** 2
        )
        which = int(tool[k])
        radius = nodes.tools[2 * which, RADIUS]
        lately = LATELY * math.sqrt(2.0 * radius * EDGE)
        if kind[k] == RAPID_LEG or kind[k] == UNSEEN_LEG:
            settle_recent(nodes, place, found, found.way[PATH] + 1.0)
            if kind[k] == RAPID_LEG:
                s = put_sweep(
                    nodes, legs[k, FX], legs[k, FY], legs[k, FZ], legs[k, TX], legs[k, TY], legs[k, TZ], which
                )
                found.crash[k] = hits(nodes, s)
                nodes.kept[s] = 1
                drop_one(nodes, s)
        elif kind[k] == PLUNGE_LEG:
            s = put_sweep(nodes, legs[k, FX], legs[k, FY], legs[k, FZ], legs[k, TX], legs[k, TY], legs[k, TZ], which)
            found.way[PATH] += length
            push_recent(nodes, place, found, s, found.way[PATH])
        elif length > 0.0:
            settle_recent(nodes, place, found, found.way[PATH] - lately)
            before = found.told_of[RECENT]
            place.row[0] = 2 * which
            if joined[k] and found.told_of[PLACES] > 0 and found.leg[found.told_of[PLACES] - 1] == k - 1:
                last = found.told_of[PLACES] - 1
                found.stack_rows[0, 0], found.stack_rows[0, 1] = found.first[last], found.many[last]
                for i in range(WHAT):
                    found.stack[0, i] = found.told[last, i]
                found.stack_u[0] = 0.0
            else:
                look(nodes, place, found, legs, k, 0.0, before, 0)
            put_place(found, k, 0, 0.0, found.told_of[PLACES])
            found.told_of[PLACES] += 1
            own = take(nodes, place, found, legs, k, which, length, lately)
            before = found.told_of[RECENT] - own
            parts = 1
            if length > SHORT * radius:
                parts = min(max(math.ceil(length / (STEP * radius)), 1), ROOM_FOR_PLACES // 8)
            for part in range(parts):
                last = part + 1 == parts
                look(nodes, place, found, legs, k, 1.0 if last else (part + 1.0) / parts,
                     before + own if last and joined[k + 1] else before, 1)  # fmt: skip
                between(nodes, place, found, legs, k, length, radius, before)
            found.way[PATH] += length
        leg += 1
    return leg


@entry
def settle(nodes, place, found):
    """Cuts away everything that was taken."""
    settle_recent(nodes, place, found, found.way[PATH] + 1.0)


@entry
def peek(nodes, place, found, legs, tool, leg):
    """Puts down the place at the begin of a leg that is not gone."""
    place.row[0] = 2 * int(tool[leg])
    look(nodes, place, found, legs, leg, 0.0, found.told_of[RECENT], 0)
    put_place(found, leg, 0, 0.0, found.told_of[PLACES])
    found.told_of[PLACES] += 1


@inner
def off_line(told, u, a, b, i, columns):
    """How far place i is from the straight line between places a and b, in units of what may be missed, by some columns."""
    w = (u[i] - u[a]) / (u[b] - u[a])
    most = 0.0
    allowed = BENT * max(told[b, WHAT - 1], 1e-12)
    for c in range(columns):
        value = told[a, c] + w * (told[b, c] - told[a, c])
        missed = abs(told[i, c] - value) / (allowed if c < DEPTH else (0.002 if c == DEPTH else 0.005))
        most = max(most, missed)
    return most


@entry
def thin(motion, u, told, columns, keep, stack):
    """Marks in keep (n,) the places without which the engagement along its motion would not be the same; stack (n, 2).

    columns: DEPTH for all that the force depends on, two more for depth and sum of the arcs.
    """
    n = motion.shape[0]
    a = 0
    while a < n:
        keep[a] = True
        b = a
        while b + 1 < n and motion[b + 1] == motion[a] and u[b + 1] > u[b]:
            b += 1
        keep[b] = True
        for i in range(a + 1, b):
            on = told[i, 0] > 0.0
            if on != (told[i - 1, 0] > 0.0) or on != (told[i + 1, 0] > 0.0):
                keep[i] = True
        top = 0
        first = a
        for i in range(a + 1, b + 1):
            if keep[i]:
                stack[top, 0], stack[top, 1] = first, i
                top += 1
                first = i
        while top > 0:
            top -= 1
            low, high = stack[top, 0], stack[top, 1]
            worst, where = 1.0, -1
            for i in range(low + 1, high):
                off = off_line(told, u, low, high, i, columns)
                if off > worst:
                    worst, where = off, i
            if where >= 0:
                keep[where] = True
                stack[top, 0], stack[top, 1] = low, where
                stack[top + 1, 0], stack[top + 1, 1] = where, high
                top += 2
        a = b + 1
    return 0
