"""Arc with which a controller blends the corner between two segments, tangent to both, compiled.

The rules are those of the planner of LinuxCNC 2.9: it computes the radius for two lines, with the chord in place of an arc
that encloses the corner, and then places the circle tangent to the true segments.

Source: LinuxCNC 2.9, src/emc/tp/blendmath.c.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import numpy as np

from camcomp.ground.compiled import inner

NORMAL = 0.5 * np.sqrt(3.0)  # of the acceleration: centripetal share; the tangential share is one half
PARALLEL = 1e-12  # rad², square of the angle below which two planes are equal
CLOSE = 1e-6  # relative excess over the allowed deviation of a corner
ANGLE, LENGTH = 1e-6, 1e-6  # rad, mm: least size of an arc


@inner
def arc_room(radius, most, inward, half):
    """Length (mm) of an arc segment available for blending, and the reduction (rad) of half the corner angle by its curvature.

    most: available rad of the arc. inward: the corner lies inside its circle, where the controller computes with chords.
    """
    part = min(most, half if inward else 0.5 * np.pi)
    if inward:
        return np.sin(0.25 * part) * radius, 0.25 * part
    return part * radius, 0.0


@inner
def touching(turn, size, first, first_x, first_y, second, second_x, second_y):
    """Centre (x, y) mm of the circle of radius `size` that touches two segments on the inner side of their corner.

    The corner is the origin, the first segment arrives along x and the second leaves it `turn` rad to the left. first, second:
    distance of the centre from the centres (x, y) of arcs, 0 for lines. Newton's method from the circle that two lines have.
    """
    out = size / np.cos(0.5 * turn)
    x, y = -out * np.sin(0.5 * turn), out * np.cos(0.5 * turn)
    for _ in range(12):
        a, b, f = 0.0, 1.0, y - size
        if first > 0.0:
            away = max(np.hypot(x - first_x, y - first_y), 1e-300)
            a, b, f = (x - first_x) / away, (y - first_y) / away, away - first
        c, d, g = -np.sin(turn), np.cos(turn), y * np.cos(turn) - x * np.sin(turn) - size
        if second > 0.0:
            away = max(np.hypot(x - second_x, y - second_y), 1e-300)
            c, d, g = (x - second_x) / away, (y - second_y) / away, away - second
        det = a * d - b * c
        if abs(det) < ANGLE:
            return x, np.inf
        x, y = x - (f * d - g * b) / det, y - (a * g - c * f) / det
    return x, y


@inner
def altitude(turn, first, second):
    """Height (mm/s) of the triangle of two velocities (mm/s) `turn` rad apart, each limited so that its foot lies inside."""
    cosine = np.cos(min(turn, 0.49 * np.pi))
    a, b = min(first, second / cosine), min(second, first / cosine)
    return a * b * np.sin(turn) / np.sqrt(a * a + b * b - 2.0 * a * b * np.cos(turn))


@inner
def rounded(u, v, half, corner, axis, next_axis, middle, next_middle, radius, next_radius, most, next_most, length, next_length,
            allowed, fast, reach, next_reach, limit, velocity):  # fmt: skip
    """Speed (mm/s, 0: impossible), radius, length taken of a segment, length (mm) and centre (3,) of a blend arc.

    u, v (3,): directions before and after the corner; half: of the angle between the segments. axis, middle (3,), radius: of
    arcs; most, next_most: rad of them, length, next_length: mm of lines that may be taken. allowed: mm from the corner. fast:
    mm/s at the feed; reach, next_reach: mm/s of the segments at any feed; limit mm/s², velocity mm/s: of an axis.
    """
    none = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    nx, ny, nz = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    norm = np.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / norm, ny / norm, nz / norm
    lx, ly, lz = ny * u[2] - nz * u[1], nz * u[0] - nx * u[2], nx * u[1] - ny * u[0]  # to the side of the turn
    turn = np.pi - 2.0 * half
    first_x = first_y = second_x = second_y = lean = 0.0
    inward = next_inward = False
    if radius > 0.0:
        if 2.0 - 2.0 * abs(nx * axis[0] + ny * axis[1] + nz * axis[2]) >= PARALLEL:
            return none
        mx, my, mz = middle[0] - corner[0], middle[1] - corner[1], middle[2] - corner[2]
        first_x, first_y = mx * u[0] + my * u[1] + mz * u[2], mx * lx + my * ly + mz * lz
        inward = first_y > 0.0
        length, lean = arc_room(radius, most, inward, half)
    if next_radius > 0.0:
        if 2.0 - 2.0 * abs(nx * next_axis[0] + ny * next_axis[1] + nz * next_axis[2]) >= PARALLEL:
            return none
        mx, my, mz = next_middle[0] - corner[0], next_middle[1] - corner[1], next_middle[2] - corner[2]
        second_x, second_y = mx * u[0] + my * u[1] + mz * u[2], mx * lx + my * ly + mz * lz
        next_inward = second_y * np.cos(turn) - second_x * np.sin(turn) > 0.0
        next_length, next_lean = arc_room(next_radius, next_most, next_inward, half)
        lean = max(lean, next_lean)
    sine, cosine = np.sin(half - lean), np.cos(half - lean)
    if sine >= 1.0 or sine <= 0.0:
        return none
    widening = 1.0 / np.sqrt(
        1.0 - min(nx * nx, ny * ny, nz * nz)
    )  # of what an axis can do, in every direction of the plane
    plane = limit * widening
    normal = NORMAL * plane
    room = min(length, next_length, cosine * allowed / (1.0 - sine))
    widest = sine / cosine * room
    possible = velocity * widening
    if radius == 0.0 and next_radius == 0.0:
        possible = max(possible, altitude(turn, reach, next_reach))
    fastest = min(np.sqrt(normal * widest), fast, possible)
    time = min(np.sqrt(plane * room), fastest) / (0.5 * plane)
    size = max(fastest * fastest / normal, min(time * fastest / (turn + 2.0 * lean), widest))
    around = size * (turn + 2.0 * lean)
    if around <= LENGTH:
        return none
    first = second = 0.0
    if radius > 0.0:
        first = radius - size if inward else radius + size
    if next_radius > 0.0:
        second = next_radius - size if next_inward else next_radius + size
    if first < 0.0 or second < 0.0:
        return none
    x, y = touching(turn, size, first, first_x, first_y, second, second_x, second_y)
    if not np.hypot(x, y) - size <= allowed * (1.0 + CLOSE):
        return none
    taken, next_taken = -x, x * np.cos(turn) + y * np.sin(turn)
    if radius > 0.0:
        taken = radius * abs(np.arctan2(first_x * y - first_y * x, first_x * (first_x - x) + first_y * (first_y - y)))
    if next_radius > 0.0:
        away = np.arctan2(second_x * y - second_y * x, second_x * (second_x - x) + second_y * (second_y - y))
        next_taken = next_radius * abs(away)
    cx, cy, cz = corner[0] + x * u[0] + y * lx, corner[1] + x * u[1] + y * ly, corner[2] + x * u[2] + y * lz
    return fastest, size, max(taken, next_taken), around, cx, cy, cz
