"""Choice of the places that linear interpolation of the engagement needs (Douglas and Peucker, 1973)."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

from camcomp.ground.compiled import entry, inner
from camcomp.model.stock.front import DEPTH, WHAT
from camcomp.model.stock.places import BENT


@inner
def off_line(told, u, a, b, i, columns):
    """Largest error of the linear interpolation between places a and b at place i, in units of its tolerance."""
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
    """Mark in keep (n,) the places that linear interpolation along their motion needs; stack (n, 2): work space.

    columns: DEPTH for the integrals that determine the force, two more for depth and sum of the arcs.
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
