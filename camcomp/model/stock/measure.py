"""Where the tool meets material at one place of its path: arcs of the turn, with the height of tool that cuts in each.

Angles count as in camcomp/model/cutting/engagement.py for a clockwise spindle: 0 left of the feed, pi/2 along it, pi
right of it. Material counts on the front half of the tool, where its surface moves towards it, when it is thicker than
EDGE across the tool's axis and stands higher than FLOOR: a finished wall or floor is not cut again because numbers are
rounded. What was taken on the last bit of the way lies against the tool all round its front; such sweeps, `recent`, are
put to the test one by one, with a tool slimmer by EDGE.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math
from typing import Any, NamedTuple

from camcomp.ground.datatypes import Floats
from camcomp.model.statics.compiled import inner
from camcomp.model.stock.field import CELL, XMAX, XMIN, YMAX, YMIN, ZMAX, ZMIN, above, height
from camcomp.model.stock.sweeps import (
    FLAT,
    KIND,
    NOWHERE,
    RADIUS,
    TOOL,
    X0,
    X1,
    Y0,
    Y1,
    Z0,
    Z1,
    bottom,
    passes,
    radius_at,
    slope,
)

EDGE, FLOOR = 0.002, 0.001  # mm
FEWEST, MOST = 16, 48  # angles at which the front of a tool is looked at
TURNS = 8  # halvings of the step between them
ASIDE = 0.02  # of such a step: beside an edge
SCAN, SLICES = 12, 8  # heights of a tool that is no cylinder: to find where it cuts, and there
NEAR = 1e-4  # mm to which the lowest and highest cut of such a tool are found
CLOSER = 6  # halvings of the angle beside the one where the highest was found
END_ANGLE = 1e-3  # rad from the sides of the front half; on less, a wall just cut lies against the tool
BITE = (
    6  # columns of an arc: entry, exit (rad), height (mm), rise and run of the tool's surface per length of its edge,
)
AT = 5  # and where it is, mm over the tip
DEPTH, ENGAGED, ARCS, WHAT = 5, 6, 7, 8  # of what is told of a place; in front: five integrals over the engagement


class Place(NamedTuple):
    """Room to work in at a place, and what was found there."""

    at: Floats  # (8,) tip (mm), direction of the feed in the plane, climb per mm; what lay_back notes
    row: Any  # (1,) int64, row of the tool
    recent: Any  # (n,) int64, sweeps that are not cut away yet
    many: Any  # (1,) int64, how many of them count
    told: Floats  # (WHAT,)
    arcs: Floats  # (r, 2) arcs of a place, to be united


@inner
def stands(nodes, place, radius, z, psi):
    """Height of material over z at an angle of the tool's front, mm; 0 when it does not count."""
    ex, ey = place.at[3], place.at[4]
    c, s = math.cos(psi), math.sin(psi)
    x = place.at[0] + radius * (s * ex - c * ey)
    y = place.at[1] + radius * (s * ey + c * ex)
    floor = max(z, nodes.place[ZMIN])
    top = height(nodes, x, y, floor + FLOOR)
    for r in range(place.many[0] if s <= reach_back(place, 0.0) else 0):
        if top <= floor + FLOOR:
            return 0.0
        top = min(top, bottom(nodes.sweeps, nodes.tools, place.recent[r], 1, x, y))
    return top - floor if top > floor + FLOOR else 0.0


@inner
def edge_between(nodes, place, radius, z, a, b, level):
    """Angle between a and b at which the material passes a height `level` over z."""
    above = stands(nodes, place, radius, z, a) > level
    for _ in range(TURNS):
        middle = 0.5 * (a + b)
        if (stands(nodes, place, radius, z, middle) > level) == above:
            a = middle
        else:
            b = middle
    return 0.5 * (a + b)


@inner
def add_bite(place, bites, n, start, stop, tall, rise, run, at):
    """Puts down an arc; the number of arcs."""
    if stop <= start or n >= bites.shape[0]:
        return n
    bites[n, 0], bites[n, 1], bites[n, 2], bites[n, 3], bites[n, 4], bites[n, AT] = start, stop, tall, rise, run, at
    told = place.told
    told[0] += tall * (stop - start)
    told[1] += tall * (math.cos(start) - math.cos(stop))
    told[2] += tall * (math.sin(stop) - math.sin(start))
    told[3] += tall * 0.5 * (math.sin(2.0 * stop) - math.sin(2.0 * start))
    told[4] += tall * 0.5 * (math.cos(2.0 * start) - math.cos(2.0 * stop))
    k = int(told[ARCS])
    if k < place.arcs.shape[0]:
        place.arcs[k, 0], place.arcs[k, 1] = start, stop
        told[ARCS] += 1
    return n + 1


@inner
def united(place):
    """Sum of the angles that lie in any arc, rad."""
    arcs, n = place.arcs, int(place.told[ARCS])
    for i in range(1, n):  # few, and mostly in order
        a, b = arcs[i, 0], arcs[i, 1]
        j = i - 1
        while j >= 0 and arcs[j, 0] > a:
            arcs[j + 1, 0], arcs[j + 1, 1] = arcs[j, 0], arcs[j, 1]
            j -= 1
        arcs[j + 1, 0], arcs[j + 1, 1] = a, b
    total, reach = 0.0, -1.0
    for i in range(n):
        total += max(arcs[i, 1] - max(arcs[i, 0], reach), 0.0)
        reach = max(reach, arcs[i, 1])
    return total


@inner
def angles_of(nodes, radius):
    """At how many angles the front is looked at."""
    return min(max(int(math.pi * radius / (2.0 * nodes.place[CELL])), FEWEST), MOST)


@inner
def step_beside(nodes, place, radius, z, edge, psi, here):
    """Angle between an edge and an angle psi at which the material, `here` mm high at psi, steps, and its height before."""
    first = edge + ASIDE * (psi - edge)
    high = stands(nodes, place, radius, z, first)
    if high <= 0.0 or abs(high - here) <= 2.0 * EDGE + 0.02 * max(high, here):
        return edge, 0.0
    return edge_between(nodes, place, radius, z, first, psi, 0.5 * (high + here)), high


@inner
def look_round(nodes, place, bites, n, radius, z):
    """Arcs of a cylinder, as high as the material is in each; the number of arcs."""
    count = angles_of(nodes, radius)
    begin, end = END_ANGLE, math.pi - END_ANGLE
    start, top, sum_, members = -1.0, 0.0, 0.0, 0
    before, last = 0.0, begin
    for k in range(count + 2):
        psi = end if k == count + 1 else (begin if k == 0 else begin + (k - 0.5) / count * (end - begin))
        now = stands(nodes, place, radius, z, psi)
        mean = sum_ / members if members > 0 else 0.0  # a slope is divided as often as it takes
        same = abs(now - mean) <= 2.0 * EDGE + 0.02 * max(now, mean)
        if k == 0:
            if now > 0.0:
                start, sum_, members = 0.0, now, 1
        elif same and (now > 0.0) == (before > 0.0):
            if now > 0.0:
                sum_ += now
                members += 1
        else:
            both = min(now, before) > 0.0
            at = edge_between(nodes, place, radius, z, last, psi, 0.5 * (now + before) if both else 0.0)
            if before > 0.0:
                step, high = at, 0.0
                if not both:
                    step, high = step_beside(nodes, place, radius, z, at, last, before)
                n = add_bite(place, bites, n, start, step, sum_ / members, 1.0, 0.0, 0.0)
                n = add_bite(place, bites, n, step, at, high, 1.0, 0.0, 0.0)
                top = max(top, high)
            start, sum_, members = at, now, 1
            if now > 0.0 and not both:
                start, high = step_beside(nodes, place, radius, z, at, psi, now)
                n = add_bite(place, bites, n, at, start, high, 1.0, 0.0, 0.0)
                top = max(top, high)
        top = max(top, now)
        before, last = now, psi
    if before > 0.0:
        n = add_bite(place, bites, n, start, math.pi, sum_ / members, 1.0, 0.0, 0.0)
    place.told[DEPTH] = max(place.told[DEPTH], top)
    return n


@inner
def point_of(place, radius, c, s):
    """Where the tool's front has a radius at an angle with this cosine and sine."""
    ex, ey = place.at[3], place.at[4]
    return place.at[0] + radius * (s * ex - c * ey), place.at[1] + radius * (s * ey + c * ex)


@inner
def lay_back(nodes, place):
    """Notes how far beside and below the tip the ways of the last bit lie, per mm behind it; without bound ahead of it."""
    at = place.at
    aside = below = 0.0
    for r in range(place.many[0]):
        k = place.recent[r]
        if 2 * int(nodes.sweeps[k, TOOL]) != place.row[0]:
            aside = NOWHERE
        for end in range(2):
            dx = nodes.sweeps[k, X1 if end else X0] - at[0]
            dy = nodes.sweeps[k, Y1 if end else Y0] - at[1]
            if dx * dx + dy * dy < NEAR * NEAR:
                continue
            back = -(dx * at[3] + dy * at[4])
            if back <= 0.0:
                aside = NOWHERE
                continue
            aside = max(aside, abs(dx * at[4] - dy * at[3]) / back)
            below = max(below, (at[2] - nodes.sweeps[k, Z1 if end else Z0]) / back)
    at[6], at[7] = aside, below


@inner
def reach_back(place, run):
    """Sine of the angle of the front beyond which nothing that was taken lies, where the radius grows by `run` per height.

    A tool that stood b mm behind the tip, l beside and d below it, is over a point of the front at psi where
    b sin(psi) <= l + d run, as long as it would not have been so everywhere.
    """
    return place.at[6] + place.at[7] * run


@inner
def taken(nodes, place, x, y, level):
    """Whether what is not cut away yet, but taken, is as low as a level over a point."""
    for r in range(place.many[0]):
        if passes(nodes.sweeps, nodes.tools, place.recent[r], 1, x, y, level):
            return True
    return False


@inner
def meets(nodes, place, radius, run, level, c, s):
    """Whether material stands higher than a level at an angle of the tool's front, whose radius grows by `run` per height."""
    x, y = point_of(place, radius, c, s)
    return above(nodes, x, y, level) and (s > reach_back(place, run) or not taken(nodes, place, x, y, level))


@inner
def look_slice(nodes, place, bites, n, radius, lift, tall, rise, run, least, thin):
    """Arcs of a slice, `lift` mm over the tip and `tall` mm high, with this rise and run; the number of arcs.

    least (rad): angle at both sides at which the surface begins to move towards the material. thin: how much the radius
    grows per height there.
    """
    count = angles_of(nodes, radius)
    level = max(place.at[2] + lift, nodes.place[ZMIN]) + FLOOR
    begin = least + END_ANGLE
    step = (math.pi - 2.0 * begin) / (count + 1)
    c, s = math.cos(begin), math.sin(begin)
    turn_c, turn_s = math.cos(step), math.sin(step)
    start = least
    before = meets(nodes, place, radius, thin, level, c, s)
    for k in range(1, count + 2):
        c0, s0 = c, s
        c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
        now = meets(nodes, place, radius, thin, level, c, s)
        if now == before:
            continue
        c1, s1 = c, s
        at, part = begin + (k - 1) * step, 0.5 * step
        for _ in range(TURNS):
            cm, sm = c0 + c1, s0 + s1
            size = math.sqrt(cm * cm + sm * sm)
            cm, sm = cm / size, sm / size
            if meets(nodes, place, radius, thin, level, cm, sm) == before:
                c0, s0 = cm, sm
                at += part
            else:
                c1, s1 = cm, sm
            part *= 0.5
        at += part
        if before:
            n = add_bite(place, bites, n, start, at, tall, rise, run, lift)
        start, before = at, now
    if before:
        n = add_bite(place, bites, n, start, math.pi - least, tall, rise, run, lift)
    return n


@inner
def cuts_at(nodes, place, row, lift, k, count):
    """Whether a tool that is no cylinder meets material at a height over its tip and at an angle of its front."""
    radius = radius_at(nodes.tools, row, lift)
    run = 1.0 / max(slope(nodes.tools, row, radius), 1e-12)
    least = least_angle(place.at[5], run)
    if least >= 0.5 * math.pi:
        return False
    psi = least + (k + 0.5) / count * (math.pi - 2.0 * least)
    level = max(place.at[2] + lift, nodes.place[ZMIN]) + FLOOR
    return meets(nodes, place, max(radius - EDGE, 0.0), run, level, math.cos(psi), math.sin(psi))


@inner
def least_angle(climb, run):
    """From which angle on a surface with this run per rise moves towards what is in front of it, on a climbing way."""
    if climb <= 0.0:
        return 0.0
    sine = climb * run
    return math.asin(sine) if sine < 1.0 else 0.5 * math.pi


@inner
def limit(nodes, place, row, inside, outside, k, count):
    """Height over the tip between one where the tool cuts, at angle k, and one where it does not, to which it cuts at any angle."""
    best, most = inside, float(k)
    for turn in range(count):
        best, most = farther(nodes, place, row, best, outside, most, float(turn), count)
    if outside < inside:
        return best
    apart, end = 0.5, nodes.place[ZMAX] - FLOOR - place.at[2]
    for _ in range(CLOSER):  # a ridge may end in between
        middle = most
        for side in (-1.0, 1.0):
            at = min(max(middle + side * apart, 0.0), count - 1.0)
            best, most = farther(nodes, place, row, best, end, most, at, count)
        apart *= 0.5
    return best


@inner
def farther(nodes, place, row, best, outside, most, at, count):
    """How far the tool cuts, and at which angle: `best` at `most`, or more at another one."""
    step = 1.0 if outside > best else -1.0
    if step * (outside - best) <= NEAR or not cuts_at(nodes, place, row, best + 0.1 * step * NEAR, at, count):
        return best, most
    if cuts_at(nodes, place, row, outside - 0.5 * step * NEAR, at, count):
        return outside, at
    a, b, gap = best, best, 8.0 * NEAR
    while b != outside:  # steps that grow, and then halves
        b = best + step * min(gap, step * (outside - best))
        if not cuts_at(nodes, place, row, b, at, count):
            break
        a = b
        gap *= 2.0
    while abs(b - a) > NEAR:
        middle = 0.5 * (a + b)
        if cuts_at(nodes, place, row, middle, at, count):
            a = middle
        else:
            b = middle
    return a, at


@inner
def look_over(nodes, place, bites, n, row):
    """Arcs of a tool that is no cylinder, slice by slice."""
    highest = nodes.place[ZMAX] - FLOOR - place.at[2]  # nothing counts as higher
    count = angles_of(nodes, nodes.tools[row, RADIUS])
    low, high, above, below = -1.0, -1.0, highest, 0.0
    before, last, first = 0.0, 0, 0
    for j in range(SCAN):
        lift = highest * ((j + 0.5) / SCAN) ** 2
        found = False
        for turn in range(count):
            k = (last + turn) % count  # where it cuts a little lower it mostly does here
            if cuts_at(nodes, place, row, lift, float(k), count):
                found, last = True, k
                break
        if found:
            if low < 0.0:
                low, below, first = lift, before, last
            high, above = lift, highest
        elif high == before and high > 0.0:
            above = lift
        before = lift
    if low < 0.0:
        return n
    high = limit(nodes, place, row, high, above, last, count)
    low = limit(nodes, place, row, low, below, first, count)
    if low < 1e-3:
        low = 0.0
    for j in range(SLICES):  # thinner towards both ends, where the arcs change most
        a = low + (high - low) * 0.5 * (1.0 - math.cos(math.pi * j / SLICES))
        b = low + (high - low) * 0.5 * (1.0 - math.cos(math.pi * (j + 1) / SLICES))
        run = radius_at(nodes.tools, row, b) - radius_at(nodes.tools, row, a)
        edge = math.sqrt(run * run + (b - a) * (b - a))
        middle = 0.5 * (a + b)
        radius = radius_at(nodes.tools, row, middle)
        thin = 1.0 / max(slope(nodes.tools, row, radius), 1e-12)
        least = least_angle(place.at[5], thin)
        radius -= EDGE
        if least < 0.5 * math.pi and radius > 0.0:
            n = look_slice(nodes, place, bites, n, radius, middle, b - a, (b - a) / edge, run / edge, least, thin)
    place.told[DEPTH] = high if place.told[ARCS] > 0.0 else 0.0
    return n


@inner
def measure(nodes, place, bites, n):
    """What the tool meets at a place: arcs into `bites` from row n on, sums into place.told; the number of rows."""
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
    if nodes.tools[row, KIND] == FLAT:
        n = look_round(nodes, place, bites, n, radius - EDGE, z)
    else:
        n = look_over(nodes, place, bites, n, row)
    told[ENGAGED] = united(place)
    return n
