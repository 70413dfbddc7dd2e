"""Duration of segments and corners at the largest speed that acceleration and look-ahead allow, compiled."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import numpy as np

from camcomp.ground.compiled import entry, inner
from camcomp.model.trajectory.corners import ON, OVERLAP, REST, ROUND, WAIT, pace

STOP = 2.0  # cycles, measured: duration of a stop in addition to deceleration and acceleration


@inner
def along(i, reachable, acceleration, radius, way):
    """Tangential acceleration of segment i (mm/s²), less the shares of turning and of overlapping neighbours.

    A stop that replaces an overlap (WAIT) counts as an overlap.
    """
    a = acceleration[i]
    if way[i] in (OVERLAP, WAIT) or (i > 0 and way[i - 1] == OVERLAP):
        a *= 0.5
    return pace(a, reachable[i], radius[i])


@inner
def straight_part(i, nominal, way, reach):
    """Length of segment i without the blend arcs at its corners, mm."""
    length = nominal[i]
    if way[i] == ROUND:
        length -= reach[i]
    if i > 0 and way[i - 1] == ROUND:
        length -= reach[i - 1]
    return max(length, 0.0)


@entry
def pieces(nominal, fast, reachable, acceleration, radius, way, speed, reach, bend, around, length, slope, most):
    """Fill length mm, slope mm/s² and most mm/s (2 m,) of the pieces: segments at even, corners at odd indices.

    nominal (m,) mm, fast, reachable (m,) mm/s at the feed and at any feed, acceleration (m,) mm/s² along the path, radius
    (m,) mm of arcs, 0 for lines; way, speed, reach, bend, around (m,): of the corners (corners.py).
    """
    for i in range(nominal.shape[0]):
        length[2 * i] = straight_part(i, nominal, way, reach)
        slope[2 * i] = along(i, reachable, acceleration, radius, way)
        most[2 * i] = fast[i]
        length[2 * i + 1], slope[2 * i + 1], most[2 * i + 1] = 0.0, acceleration[i], 0.0
        if way[i] == ON:
            most[2 * i + 1] = speed[i]
        elif way[i] == ROUND:
            length[2 * i + 1], most[2 * i + 1] = around[i], min(speed[i], max(fast[i], fast[i + 1]))
            slope[2 * i + 1] = pace(acceleration[i], speed[i], bend[i])


@entry
def durations(length, slope, most, way, speed, cycle, depth, arrives, limit, time):
    """Fill time (m,) s of segments (m,), each with the corner after it.

    length mm, slope mm/s², most mm/s (2 m,): of pieces. way, speed (m,): of corners. cycle: s. depth: segments of look-ahead.
    arrives: mm/s at the start of the first one. limit (2 m,): filled with the speeds at the start of every piece.
    """
    count = length.shape[0]
    ahead = 0.0  # mm²/s², gain of the squared speed over the look-ahead
    behind = count - 1
    leaves = 0.0  # mm/s
    for k in range(count - 1, -1, -1):
        gain = 2.0 * slope[k] * length[k]
        ahead += gain
        if behind - k >= 2 * depth:
            ahead -= 2.0 * slope[behind] * length[behind]
            behind -= 1
        leaves = min(leaves, most[k])
        leaves = min(np.sqrt(min(leaves * leaves + gain, max(ahead, 0.0))), most[k])
        limit[k] = leaves
    now = min(arrives, limit[0])
    for k in range(count):
        a, way_long, fastest = slope[k], length[k], most[k]
        limit[k] = now
        goal = 0.0
        if k + 1 < count:
            goal = min(limit[k + 1], fastest)
        spent = 0.0
        if way_long > 0.0:
            gain = 2.0 * a * way_long
            if goal * goal > now * now + gain:
                goal = np.sqrt(now * now + gain)
            top = fastest
            if now * now + goal * goal + gain < 2.0 * top * top:
                top = np.sqrt(0.5 * (now * now + goal * goal + gain))
            top = max(top, now, goal)
            cruise = max(way_long - (2.0 * top * top - now * now - goal * goal) / (2.0 * a), 0.0)
            spent = (2.0 * top - now - goal) / a + (cruise / top if top > 0.0 else 0.0)
        else:
            goal = min(goal, now)
        i = k // 2
        if k % 2 == 0:
            time[i] = spent
        else:
            time[i] += spent
            if way[i] == OVERLAP:
                time[i] = max(time[i] - speed[i] / (0.5 * a), 0.0)
            elif way[i] in (REST, WAIT):
                time[i] += STOP * cycle
        now = goal
