"""Engagement arcs of ball, bull and drill tools, slice by slice of their height."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import inner
from camcomp.model.stock.field import ZMAX, ZMIN
from camcomp.model.stock.front import (
    DEPTH,
    EDGE,
    END_ANGLE,
    FLOOR,
    NEAR,
    TURNS,
    add_arc,
    angles_of,
    least_angle,
    meets,
)
from camcomp.model.stock.sweeps import RADIUS, radius_at, slope

SCAN, SLICES = 12, 8  # sampled heights of the tool to find the range of the cut, and slices within it
CLOSER = 6  # halvings of the angle around the one with the highest cut


@inner
def look_slice(nodes, place, arc_rows, n, radius, lift, tall, rise, run, least, thin, stride, first):
    """Append the arcs of a slice, `lift` mm over the tip and `tall` mm high, and return the new number of arcs.

    rise, run: of the tool's surface per length of its edge. least (rad): angle from both sides at which the surface begins
    to move towards the material. thin: growth of the radius per height. stride: 2 for every second angle only, from
    number `first` on.
    """
    count = angles_of(nodes, radius)
    level = max(place.at[2] + lift, nodes.place[ZMIN]) + FLOOR
    begin = least + END_ANGLE
    step = (math.pi - 2.0 * begin) / (count + 1)
    c, s = math.cos(begin), math.sin(begin)
    turn_c, turn_s = math.cos(step), math.sin(step)
    start = least
    before = meets(nodes, place, radius, thin, level, c, s)
    k = 0
    while k <= count:
        c0, s0 = c, s
        steps = min(stride if k > 0 else first, count + 1 - k)
        for _ in range(steps):
            c, s = c * turn_c - s * turn_s, s * turn_c + c * turn_s
        k += steps
        now = meets(nodes, place, radius, thin, level, c, s)
        if now == before:
            continue
        c1, s1 = c, s
        at, part = begin + (k - steps) * step, 0.5 * steps * step
        for _ in range(TURNS + steps - 1):
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
            n = add_arc(arc_rows, n, start, at, tall, rise, run, lift)
        start, before = at, now
    if before:
        n = add_arc(arc_rows, n, start, math.pi - least, tall, rise, run, lift)
    return n


@inner
def cuts_at(nodes, place, row, lift, k, count):
    """Whether a ball, bull or drill tool meets material at a height over its tip and an angle of its front."""
    radius = radius_at(nodes.tools, row, lift)
    run = 1.0 / max(slope(nodes.tools, row, radius), 1e-12)
    least = least_angle(place.at[5], run)
    if least >= 0.5 * math.pi:
        return False
    psi = least + (k + 0.5) / count * (math.pi - 2.0 * least)
    level = max(place.at[2] + lift, nodes.place[ZMIN]) + FLOOR
    return meets(nodes, place, max(radius - EDGE, 0.0), run, level, math.cos(psi), math.sin(psi))


@inner
def limit(nodes, place, row, inside, outside, k, count):
    """Height over the tip up to which the tool cuts at any angle, between `inside` (cut at angle k) and `outside` (no cut)."""
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
    """Height up to which the tool cuts, and its angle: `best` at angle `most`, or a larger one at a neighbour."""
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
def look_over(nodes, place, arc_rows, n, row):
    """Append the arcs of a ball, bull or drill tool slice by slice, and return the new number of arcs."""
    highest = nodes.place[ZMAX] - FLOOR - place.at[2]  # upper bound
    count = angles_of(nodes, nodes.tools[row, RADIUS])
    low, high, above, below = -1.0, -1.0, highest, 0.0
    before, last, first = 0.0, 0, 0
    for j in range(SCAN):
        lift = highest * ((j + 0.5) / SCAN) ** 2
        found = False
        for turn in range(count):
            k = (last + turn) % count  # the angle of the cut below is the likeliest
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
    begun, arcs = n, -1
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
            own, tall, rise, lean = n, b - a, (b - a) / edge, run / edge
            if arcs >= 0:  # alternate angles from slice to slice, and all angles where neighbours differ
                n = look_slice(nodes, place, arc_rows, own, radius, middle, tall, rise, lean, least, thin, 2, 1 + j % 2)
            if n - own != arcs:
                n = look_slice(nodes, place, arc_rows, own, radius, middle, tall, rise, lean, least, thin, 1, 1)
            arcs = n - own
    place.told[DEPTH] = high if n > begun else 0.0
    return n
