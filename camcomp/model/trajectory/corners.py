"""Corner between two segments of a controller's trajectory, compiled: stop, tangent, arc, or overlap in time.

The rules are those of the planner of LinuxCNC 2.9, which chooses the fastest possibility: straight on where the jump of
direction is a small acceleration within one cycle; else an arc that touches both segments; else the next segment
starts while the one before still slows down.

Source: LinuxCNC 2.9, src/emc/tp/tp.c and blendmath.c.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import numpy as np

from camcomp.ground.compiled import entry, inner
from camcomp.model.trajectory.rounding import ANGLE, LENGTH, NORMAL, rounded

REST, ON, ROUND, OVERLAP, WAIT = 0, 1, 2, 3, 4
KINK = 0.1  # of the acceleration: largest jump of direction within a cycle
BACK = (2.0 * np.pi / 180.0) ** 2  # rad², square of the angle to a full reversal that counts as one
OPEN = 0.25  # of a segment's length: largest deviation at a corner without a tolerance
CYCLES = 1.02  # least duration of a segment
LATE = 0.7  # cycles, measured: extra duration of an overlap, which begins and ends with a cycle


@inner
def pace(acceleration, most, radius):
    """Tangential acceleration (mm/s²) of a segment after its centripetal share; radius mm, 0 for lines.

    most: largest speed of the machine along it, mm/s; the controller reserves the centripetal acceleration of that speed,
    whatever the feed.
    """
    if radius > 0.0:
        turning = min(most * most / radius / acceleration, NORMAL)
        acceleration *= np.sqrt(1.0 - turning * turning)
    return acceleration


@inner
def overlap_speed(part, acceleration, next_acceleration, tolerance, sine, cosine, length, ahead, fast, fast_ahead):
    """Speed (mm/s) at which the overlap of two segments begins, and the speed through their corner.

    part: share of both lengths that is available; half while the next corners may take the other half.
    """
    reach = min(np.sqrt(acceleration * part * length), fast)
    reach_ahead = min(np.sqrt(next_acceleration * part * ahead), fast_ahead)
    longest = min(length / reach, ahead / reach_ahead)
    time = min(longest, max(reach / acceleration, reach_ahead / next_acceleration))
    speed, next_speed = min(reach, time * acceleration), min(reach_ahead, time * next_acceleration)
    if tolerance > 0.0 and cosine > 1e-3:
        allowed = 2.0 * np.sqrt(acceleration * tolerance / cosine)
        speed, next_speed = min(speed, allowed), min(next_speed, allowed)
    return speed, 0.5 * sine * (speed + next_speed)


@inner
def overlap_gap(time, acceleration, next_acceleration, cosine):
    """Least distance (mm) from the corner of the sum of a motion that stops within `time` (s) and one that starts."""
    straight = 2.0 * cosine * cosine - 1.0  # minus the cosine of the turn
    nearest = np.inf
    for k in range(33):
        spent = time * k / 32.0
        x, y = 0.5 * acceleration * (time - spent) ** 2, 0.5 * next_acceleration * spent**2
        nearest = min(nearest, x * x + y * y + 2.0 * straight * x * y)
    return np.sqrt(max(nearest, 0.0))


@entry
def corners(leave, arrive, axis, middle, radius, angle, nominal, fast, most, acceleration, rapid, per_turn, exact, stop, waits, tolerance, limit, velocity, cycle,
            way, speed, reach, bend, around, centre, end):  # fmt: skip
    """Fill way, speed, reach, bend, around (m,) and centre (m, 3) of the corners after segments (m,); the last is a stop.

    Shapes and units:
        leave, arrive: (m, 3) unit directions at the start and at the end.
        axis, middle, radius, angle: (m, 3), (m, 3), (m,), (m,) of arcs; radius 0 for lines.
        nominal: (m,) lengths, mm.
        fast, most: (m,) speeds at the programmed feed and at any feed, mm/s.
        acceleration: (m,) along the segment, mm/s².
        rapid, exact, stop, waits: (m,) rapid; exact path; stop after the segment; stop before it.
        per_turn: (m,) feed per revolution, which the controller plans as if at any feed.
        tolerance: (m,) mm, 0: open.
        limit, velocity: of an axis, mm/s² and mm/s.
        cycle: s.
        end: (m, 3) corners, mm.
        way: REST, ON, ROUND, OVERLAP or WAIT (a stop in place of an overlap).
        speed: through the corner (OVERLAP: at its start), mm/s.
        reach, bend, around, centre: of the arc: length taken of both segments, radius, length, centre, mm.
    """
    m = nominal.shape[0]
    left = nominal[0]
    for i in range(m):
        way[i], speed[i], reach[i], bend[i], around[i] = REST, 0.0, 0.0, 0.0, 0.0
        if i == m - 1:
            break
        j = i + 1
        u, v = arrive[i], leave[j]
        if waits[j] and not (exact[i] or stop[i]):
            way[i] = WAIT
        bx, by, bz = v[0] + u[0], v[1] + u[1], v[2] + u[2]
        if stop[i] or waits[j] or rapid[i] != rapid[j] or bx * bx + by * by + bz * bz < BACK:
            left = nominal[j]
            continue
        told, told_ahead = most[i] if per_turn[i] else fast[i], most[j] if per_turn[j] else fast[j]
        slower = min(told, told_ahead)
        jump = slower / cycle + acceleration[j]
        scale = max(abs(v[0] - u[0]), abs(v[1] - u[1]), abs(v[2] - u[2])) * jump / limit
        if radius[i] > 0.0 or radius[j] > 0.0:
            scale *= 2.0
        if scale < KINK:
            way[i], speed[i] = ON, slower
            left = nominal[j]
            continue
        if exact[i]:
            left = nominal[j]
            continue
        straight = slower * KINK / scale
        # half the angle between the segments
        half = 0.5 * np.arccos(min(max(-(u[0] * v[0] + u[1] * v[1] + u[2] * v[2]), -1.0), 1.0))
        sine, cosine = np.sin(half), np.cos(half)
        first = tolerance[i] if tolerance[i] > 0.0 else OPEN * nominal[i]
        second = tolerance[j] if tolerance[j] > 0.0 else OPEN * nominal[j]
        allowed = min(first, second, OPEN * nominal[i], OPEN * nominal[j])
        half_pace = pace(0.5 * acceleration[i], most[i], radius[i])
        next_half_pace = pace(0.5 * acceleration[j], most[j], radius[j])
        _, overlap = overlap_speed(
            0.5, half_pace, next_half_pace, tolerance[i], sine, cosine, left, nominal[j], fast[i], fast[j]
        )
        arc, size, distance, cx, cy, cz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if ANGLE < half < 0.5 * np.pi - ANGLE:
            arc, size, distance, length, cx, cy, cz = rounded(
                u, v, half, end[i], axis[i], axis[j], middle[i], middle[j], radius[i], radius[j], 2.0 / 3.0 * angle[i],
                angle[j] / 3.0, min(left, 0.5 * nominal[i]), 0.5 * nominal[j], allowed, max(told, told_ahead), most[i], most[j], limit, velocity,
            )  # fmt: skip
            if arc > 0.0:
                rest = left - distance
                taken = length + (max(rest, 0.0) if radius[i] == 0.0 and rest < 4.0 * cycle * arc else 0.0)
                arc = min(arc, taken / (CYCLES * cycle))
        if arc > straight and arc > 0.5 * overlap:
            way[i], speed[i], reach[i], bend[i], around[i] = ROUND, arc, distance, size, length
            centre[i, 0], centre[i, 1], centre[i, 2] = cx, cy, cz
            left = nominal[j] - distance
        elif per_turn[j] and not per_turn[i]:
            left = nominal[j]  # a feed per revolution does not overlap with a feed per minute
        elif 0.5 * overlap > straight:
            begin, _ = overlap_speed(
                1.0, half_pace, next_half_pace, tolerance[i], sine, cosine, left, nominal[j], fast[i], fast[j]
            )
            way[i], speed[i] = OVERLAP, begin
            # an arc at the same distance from the corner as the sum of the two motions
            time = begin / half_pace + (LATE * cycle if begin < fast[i] else 0.0)
            gap = overlap_gap(time, half_pace, next_half_pace, cosine)
            distance = gap * cosine / (1.0 - sine) if sine < 1.0 else 0.0
            reach[i], bend[i] = distance, distance * sine / cosine if cosine > 0.0 else 0.0
            wx, wy, wz = v[0] - u[0], v[1] - u[1], v[2] - u[2]
            norm = max(np.sqrt(wx * wx + wy * wy + wz * wz), 1e-300)
            out = bend[i] / sine / norm
            centre[i, 0], centre[i, 1], centre[i, 2] = end[i, 0] + out * wx, end[i, 1] + out * wy, end[i, 2] + out * wz
            left = nominal[j]
        else:
            way[i], speed[i] = ON, straight
            left = nominal[j]


@entry
def nearest(points, segment, start, end, arc, way, reach, bend, centre, out):
    """Fill out (k, 3) mm: vectors from points (k, 3) mm on segments (k,) to the nearest points of the trajectory.

    start, end (m, 3) mm, arc (m,), way, reach, bend (m,) and centre (m, 3) of the corners after the segments (m,). Points of
    an arc are on it; points of a line may deviate from it.
    """
    for k in range(points.shape[0]):
        s = segment[k]
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        if not arc[s]:
            mx, my, mz = end[s, 0] - start[s, 0], end[s, 1] - start[s, 1], end[s, 2] - start[s, 2]
            square = mx * mx + my * my + mz * mz
            t = (
                ((x - start[s, 0]) * mx + (y - start[s, 1]) * my + (z - start[s, 2]) * mz) / square
                if square > 0.0
                else 0.0
            )
            t = min(max(t, 0.0), 1.0)
            x, y, z = start[s, 0] + t * mx, start[s, 1] + t * my, start[s, 2] + t * mz
        fx, fy, fz = x, y, z
        ends = abs(fx - end[s, 0]) + abs(fy - end[s, 1]) + abs(fz - end[s, 2]) < LENGTH
        for side in range(2):
            c = s - 1 + side
            if ends and side == 0:  # a full circle has two corners at one position: before its start and after its end
                continue
            if c < 0 or (way[c] != ROUND and way[c] != OVERLAP):
                continue
            dx, dy, dz = fx - end[c, 0], fy - end[c, 1], fz - end[c, 2]
            if dx * dx + dy * dy + dz * dz > reach[c] * reach[c]:
                continue
            bx, by, bz = fx - centre[c, 0], fy - centre[c, 1], fz - centre[c, 2]
            share = bend[c] / max(np.sqrt(bx * bx + by * by + bz * bz), 1e-300)
            x, y, z = centre[c, 0] + share * bx, centre[c, 1] + share * by, centre[c, 2] + share * bz
        out[k, 0], out[k, 1], out[k, 2] = x - points[k, 0], y - points[k, 1], z - points[k, 2]
