"""Engagement along the legs of a program in order, and removal of their sweeps from the stock."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import entry, inner
from camcomp.model.stock.chain import along_chain, chain_from
from camcomp.model.stock.field import FREE, USED
from camcomp.model.stock.front import EDGE, WHAT
from camcomp.model.stock.places import (
    FIRST,
    FX,
    FY,
    FZ,
    MOST_CHAIN,
    MOST_RECENT,
    PATH,
    PLACES,
    PLUNGE_LEG,
    RAPID_LEG,
    RECENT,
    ROWS,
    SHORT,
    STEP,
    TX,
    TY,
    TZ,
    UNSEEN_LEG,
    between,
    copy_slot,
    leg_length,
    look,
    put_place,
)
from camcomp.model.stock.removal import cut_away, drop_one, hits, put_sweep
from camcomp.model.stock.sweeps import FLAT, KIND, RADIUS

LATELY = 1.5  # times the path length on which a sweep lies against the front of the tool by less than EDGE
FARTHER = 1.0  # of the radius, in place of STEP, where interpolation is tested cheaply
ROOM_FOR_PLACES, ROOM_FOR_ARCS = 4096, 65536  # most of one leg


@inner
def settle_recent(nodes, place, found, until):
    """Remove the recent sweeps that end before the path length `until` (mm) from the field."""
    n = int(found.told_of[RECENT])
    done = 0
    while done < n and found.recent_end[done] <= until:
        cut_away(nodes, place.recent[done], place.recent[done + 1] if done + 1 < n else -1)
        done += 1
    for k in range(done, n):
        place.recent[k - done] = place.recent[k]
        found.recent_end[k - done] = found.recent_end[k]
    found.told_of[RECENT] = n - done


@inner
def append_recent(nodes, place, found, k, end):
    """Append a sweep to the recent ones; at MOST_RECENT the oldest is removed from the field first."""
    if found.told_of[RECENT] == MOST_RECENT:
        settle_recent(nodes, place, found, found.recent_end[0])
    n = found.told_of[RECENT]
    place.recent[n] = k
    found.recent_end[n] = end
    found.told_of[RECENT] = n + 1


@inner
def take(nodes, place, found, legs, k, tool, length, lately):
    """Append the sweep of a leg to the recent ones, the end of a long leg as a sweep of its own; return their number."""
    end = found.way[PATH] + length
    ax, ay, az, bx, by, bz = legs[k, FX], legs[k, FY], legs[k, FZ], legs[k, TX], legs[k, TY], legs[k, TZ]
    if length < 3.0 * lately:
        append_recent(nodes, place, found, put_sweep(nodes, ax, ay, az, bx, by, bz, tool), end)
        return 1
    u = 1.0 - lately / length
    mx, my, mz = ax + u * (bx - ax), ay + u * (by - ay), az + u * (bz - az)
    append_recent(nodes, place, found, put_sweep(nodes, ax, ay, az, mx, my, mz, tool), end - lately)
    append_recent(nodes, place, found, put_sweep(nodes, mx, my, mz, bx, by, bz, tool), end)
    return 2


@entry
def cut_legs(nodes, place, found, kind, legs, tool, joined, leg):
    """Measure and cut the legs from number `leg` on, and return the number of the first leg that found no room.

    kind (m,): RAPID_LEG to UNSEEN_LEG. legs (m, 10): columns of places.py. tool (m,): row of the tool. joined (m + 1,):
    no corner between the leg and the one before, so that both share the place between them.
    """
    m = kind.shape[0]
    while leg < m:
        k = leg
        counts = nodes.counts
        if (
            counts[FREE] + nodes.sweeps.shape[0] - counts[USED] < MOST_CHAIN + 4
            or found.told_of[PLACES] + ROOM_FOR_PLACES > found.leg.shape[0]
            or found.told_of[ROWS] + ROOM_FOR_ARCS > found.arc_rows.shape[0]
        ):
            return leg
        length = leg_length(legs, k)
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
            append_recent(nodes, place, found, s, found.way[PATH])
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
            step = STEP if nodes.tools[2 * which, KIND] == FLAT else FARTHER
            count = chain_from(found, kind, legs, joined, k, step * radius, lately)
            if count > 1:
                for j in range(count):
                    take(nodes, place, found, legs, k + j, which, found.chain_way[j + 1] - found.chain_way[j], lately)
                    found.way[PATH] += found.chain_way[j + 1] - found.chain_way[j]
                copy_slot(found, 0, FIRST)
                along_chain(nodes, place, found, legs, k, count, radius, before, joined[k + count])
                leg += count
                continue
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
    """Remove all recent sweeps from the field."""
    settle_recent(nodes, place, found, found.way[PATH] + 1.0)


@entry
def peek(nodes, place, found, legs, tool, leg):
    """Store the place at the start of a leg without cutting the leg."""
    place.row[0] = 2 * int(tool[leg])
    look(nodes, place, found, legs, leg, 0.0, found.told_of[RECENT], 0)
    put_place(found, leg, 0, 0.0, found.told_of[PLACES])
    found.told_of[PLACES] += 1
