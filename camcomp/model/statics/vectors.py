"""Three-vectors as tuples, compiled to registers.

A pose is an array of 12: rotation row by row, position. A table of vectors keeps each in three rows of one column.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import inner

SERIES = 0.04  # rad^2: below it the closed forms lose digits and the series are exact to round-off


@inner
def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner
def cross(a, b):
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inner
def plus(a, b, factor):
    """Sum a + factor b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@inner
def unit(k):
    """Unit vector along axis k."""
    return 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0


@inner
def get(table, row, column):
    """Vector of a table."""
    return table[row, column], table[row + 1, column], table[row + 2, column]


@inner
def put(table, row, column, v):
    """Stores a vector in a table."""
    table[row, column] = v[0]
    table[row + 1, column] = v[1]
    table[row + 2, column] = v[2]


@inner
def part(a, i):
    """Vector of a[i], a[i + 1], a[i + 2]."""
    return a[i], a[i + 1], a[i + 2]


@inner
def add_to(a, i, v):
    """Adds a vector to a[i], a[i + 1], a[i + 2]."""
    a[i] += v[0]
    a[i + 1] += v[1]
    a[i + 2] += v[2]


@inner
def column(T, k):
    """Column k of the rotation of a pose: its axis k in the outer frame."""
    return T[k], T[3 + k], T[6 + k]


@inner
def turned(T, v):
    """The rotation of a pose times a vector."""
    return dot(part(T, 0), v), dot(part(T, 3), v), dot(part(T, 6), v)


@inner
def turned_back(T, v):
    """The transposed rotation of a pose times a vector."""
    return dot(column(T, 0), v), dot(column(T, 1), v), dot(column(T, 2), v)


@inner
def set_columns(T, x, y, z):
    """Sets the columns of the rotation of a pose."""
    for k in range(3):
        T[3 * k] = x[k]
        T[3 * k + 1] = y[k]
        T[3 * k + 2] = z[k]


@inner
def coefficients(t2):
    """Of t^2: a = sin t/t, b = (1 - cos t)/t^2, c = (t - sin t)/t^3, b'/t and c'/t."""
    if t2 < SERIES:
        a = 1.0 - t2 / 6.0 * (1.0 - t2 / 20.0 * (1.0 - t2 / 42.0 * (1.0 - t2 / 72.0)))
        b = 0.5 * (1.0 - t2 / 12.0 * (1.0 - t2 / 30.0 * (1.0 - t2 / 56.0 * (1.0 - t2 / 90.0))))
        c = (1.0 - t2 / 20.0 * (1.0 - t2 / 42.0 * (1.0 - t2 / 72.0 * (1.0 - t2 / 110.0)))) / 6.0
        db = -1.0 / 12.0 + t2 * (1.0 / 180.0 - t2 * (1.0 / 6720.0 - t2 / 453600.0))
        dc = -1.0 / 60.0 + t2 * (1.0 / 1260.0 - t2 * (1.0 / 60480.0 - t2 / 4989600.0))
    else:
        t = math.sqrt(t2)
        a = math.sin(t) / t
        b = (1.0 - math.cos(t)) / t2
        c = (1.0 - a) / t2
        db = (a - 2.0 * b) / t2
        dc = (b - 3.0 * c) / t2
    return a, b, c, db, dc


@inner
def rolled(w, v, first, second):
    """(I + first [w] + second [w]^2) v: exp of w for the coefficients (a, b), its left Jacobian for (b, c)."""
    n = cross(w, v)
    return plus(plus(v, n, first), cross(w, n), second)


@inner
def log_product(A, B):
    """Rotation vector of A B^T for the rotations of two poses; angles up to just below pi."""
    v = cross(column(B, 0), column(A, 0))
    v = plus(v, cross(column(B, 1), column(A, 1)), 1.0)
    v = plus(v, cross(column(B, 2), column(A, 2)), 1.0)
    s2 = 0.25 * dot(v, v)  # v = 2 sin(angle) axis
    trace = dot(column(A, 0), column(B, 0)) + dot(column(A, 1), column(B, 1)) + dot(column(A, 2), column(B, 2))
    if s2 < 1e-4 and trace > 1.0:
        scale = 1.0 + s2 / 6.0 + 3.0 / 40.0 * s2 * s2
    else:
        s = math.sqrt(s2)
        scale = math.atan2(s, 0.5 * (trace - 1.0)) / max(s, 1e-300)
    return 0.5 * scale * v[0], 0.5 * scale * v[1], 0.5 * scale * v[2]


@inner
def move(pose, shift, turn, share):
    """Move a pose by `share` of a translation and of a rotation vector in fixed axes (multiplied from the left)."""
    add_to(pose, 9, plus((0.0, 0.0, 0.0), shift, share))
    w = plus((0.0, 0.0, 0.0), turn, share)
    a, b, _, _, _ = coefficients(dot(w, w))
    set_columns(
        pose, rolled(w, column(pose, 0), a, b), rolled(w, column(pose, 1), a, b), rolled(w, column(pose, 2), a, b)
    )
