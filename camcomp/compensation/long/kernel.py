"""The inner loops of the interpolation inside tiles, compiled.

It is by Chebyshev polynomials in the position times Chebyshev polynomials in the force.

A tile is a cube. Its coefficients W hold output by output the terms of the outputs that depend on both, and behind them
those of the joints, which depend on the position alone. A force term of a higher degree goes with position terms of
lower degrees only, `count` of them: the first ones.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math
from functools import partial
from typing import Any

import numpy as np

from camcomp.ground.compiled import entry, inner
from camcomp.ground.datatypes import Floats, Ints
from camcomp.model.statics.vectors import dot, part

MISSING, SPLIT, EXACT = -3, -1, -2  # what a cell can be besides a tile
LEVELS = 6
BIAS = 1 << 17  # cells are counted from here; 2**18 of them per axis
AHEAD = 4  # rows within which an equal point is looked for
LANES = 4  # points that are looked up together
MOST_DEGREE = 8  # highest degree that the evaluation has room for
BASIC = 6  # outputs that are always asked for: correction (3), shift (3); then tilt (3), drives (m), change of the joints (m)


fast = partial(inner, fastmath=True)


def exponents(degree: int) -> np.ndarray:
    """Exponents (t, 3) of all products up to a total degree, lower degrees first, in the order of `terms`."""
    rows = [
        (i, total - k - i, k) for total in range(degree + 1) for k in range(total + 1) for i in range(total - k + 1)
    ]
    return np.array(rows, np.int64)


@inner
def cell_key(level, x, y, z, size):
    """Number of the cell of a level that holds a point; -1 when it lies out of every range."""
    s = size / (1 << level)
    i = math.floor(x / s) + BIAS
    j = math.floor(y / s) + BIAS
    k = math.floor(z / s) + BIAS
    top = 2 * BIAS
    if i < 0 or j < 0 or k < 0 or i >= top or j >= top or k >= top:
        return -1
    return (((level * top) + i) * top + j) * top + k


@inner
def find_slot(keys, key):
    """Slot of a key in an open hash table, or the empty slot where it would go."""
    n = keys.shape[0]
    h = (key ^ (key >> 15)) * 0x9E3779B1 & 0x7FFFFFFF
    slot = h % n
    while keys[slot] != -1 and keys[slot] != key:
        slot += 1
        if slot == n:
            slot = 0
    return slot


@entry
def put_cells(keys, values, new_keys, new_values):
    """Puts cells (n,) with their values into a hash table with room for them; keys of -1 are none."""
    for i in range(new_keys.shape[0]):
        if new_keys[i] != -1:
            slot = find_slot(keys, new_keys[i])
            keys[slot] = new_keys[i]
            values[slot] = new_values[i]


@inner
def find_tile(keys, values, size, x, y, z):
    """(tile, key of the last cell looked at): tile >= 0, or EXACT, or MISSING."""
    key = -1
    for level in range(LEVELS):
        key = cell_key(level, x, y, z, size)
        if key < 0:
            return EXACT, key
        slot = find_slot(keys, key)
        if keys[slot] == -1:
            return MISSING, key
        if values[slot] != SPLIT:
            return values[slot], key
    return EXACT, key


@entry
def missing_cells(keys, values, size, points, out):
    """Keys of cells that points (n, 3) need and that are not there, with repetitions only in part; the number of them."""
    n = 0
    last = -1
    for i in range(points.shape[0]):
        tile, key = find_tile(keys, values, size, points[i, 0], points[i, 1], points[i, 2])
        if tile == MISSING and key != last:
            out[n] = key
            last = key
            n += 1
    return n


@fast
def terms(degree, U, at, T, out):
    """Fills out (LANES, t) with the products of Chebyshev polynomials of three rows of U (6, LANES) from `at` on, up to a
    total degree, lower degrees first.

    T (MOST_DEGREE + 4, MOST_DEGREE + 1, LANES) is room to work in: polynomials of the rows, and behind them products of the first two.
    """
    for lane in range(LANES):
        for k in range(3):
            T[k, 0, lane] = 1.0
            T[k, 1, lane] = U[at + k, lane]
    for d in range(2, degree + 1):
        for k in range(3):
            for lane in range(LANES):
                T[k, d, lane] = 2.0 * U[at + k, lane] * T[k, d - 1, lane] - T[k, d - 2, lane]
    n = 0
    for total in range(degree + 1):
        for i in range(total + 1):
            for lane in range(LANES):
                T[3 + total, i, lane] = T[0, i, lane] * T[1, total - i, lane]
        for k in range(total + 1):
            for i in range(total - k + 1):
                for lane in range(LANES):
                    out[lane, n] = T[2, k, lane] * T[3 + total - k, i, lane]
                n += 1


@fast
def products(A, B, count, out, lane):
    """Fills out[lane] with the products of force terms B[lane] and position terms A[lane] that belong together; their number."""
    n = 0
    for b in range(count.shape[0]):
        force = B[lane, b]
        row = out[lane, n : n + count[b]]
        for a in range(row.shape[0]):
            row[a] = force * A[lane, a]
        n += count[b]
    return n


@fast
def contract(W, first, C, n, outputs, out):
    """Fills out (LANES, outputs) with the sums over n terms C (LANES, n or more); coefficients from `first` on, output by output.

    Four points and three outputs at once: every number fetched serves several products, which then set the pace.
    """
    c0, c1, c2, c3 = C[0, :n], C[1, :n], C[2, :n], C[3, :n]  # with indices from 0 on, the loop runs in vectors
    for o in range(0, outputs, 3):
        o1, o2 = min(o + 1, outputs - 1), min(o + 2, outputs - 1)
        u = W[first + o * n : first + (o + 1) * n]
        v = W[first + o1 * n : first + (o1 + 1) * n]
        w = W[first + o2 * n : first + (o2 + 1) * n]
        u0 = u1 = u2 = u3 = v0 = v1 = v2 = v3 = w0 = w1 = w2 = w3 = 0.0
        for j in range(n):
            u0 += c0[j] * u[j]
            u1 += c1[j] * u[j]
            u2 += c2[j] * u[j]
            u3 += c3[j] * u[j]
            v0 += c0[j] * v[j]
            v1 += c1[j] * v[j]
            v2 += c2[j] * v[j]
            v3 += c3[j] * v[j]
            w0 += c0[j] * w[j]
            w1 += c1[j] * w[j]
            w2 += c2[j] * w[j]
            w3 += c3[j] * w[j]
        out[0, o], out[1, o], out[2, o], out[3, o] = u0, u1, u2, u3
        out[0, o1], out[1, o1], out[2, o1], out[3, o1] = v0, v1, v2, v3
        out[0, o2], out[1, o2], out[2, o2], out[3, o2] = w0, w1, w2, w3


def look_up(
    a: int, b: int, m: int, every: bool, target: Floats, force: Floats, answer: Floats, nominal: Floats, tile_of: Ints, *packed: Any
) -> None:  # fmt: skip
    """Answers (n, 9 + 2 m) at targets (n, 3) under forces (n, 3) for rows a to b; tile_of (n,), negative: there is none.

    every: all outputs and nominal joints (n, m), or with an answer (n, 0) the joints only; otherwise correction and shift only.
    packed: those of a Field.
    """
    *_, shape, count = packed
    outputs, along, across = max(answer.shape[1], m), shape[:, 2].max(), count.shape[1]
    room = (
        np.empty((MOST_DEGREE + 4, MOST_DEGREE + 1, LANES)),
        np.zeros((6, LANES)),
        *(np.zeros((LANES, n)) for n in (along, across, along * across, outputs)),
    )
    look_up_rows(a, b, m, every, target, force, answer, nominal, tile_of, *packed, *room)


@entry
def look_up_rows(a, b, m, every, target, force, answer, nominal, tile_of, size, keys, values, centre, half, rung, first, W, mid, wide,
                 shape, count, T, U, A, B, C, out):  # fmt: skip
    """look_up with room to work in, T and U as in `terms`, the others (LANES, most terms or outputs), finite."""
    outputs = answer.shape[1]
    i = a
    while i < b:
        tile, _ = find_tile(keys, values, size, target[i, 0], target[i, 1], target[i, 2])
        tile_of[i] = tile
        if tile < 0:
            i += 1
            continue
        r, h, c = rung[tile], half[tile], centre[tile]
        along, across, inner, outer = shape[r]
        lanes = n = 0
        while lanes < LANES and i + lanes < b:  # the points behind it that lie in the same tile
            f = force[i + lanes]
            x, y, z = target[i + lanes, 0] - c[0], target[i + lanes, 1] - c[1], target[i + lanes, 2] - c[2]
            if lanes > 0 and not max(abs(x), abs(y), abs(z)) < h:
                break
            U[0, lanes], U[1, lanes], U[2, lanes] = x / h, y / h, z / h
            for k in range(3):
                U[3 + k, lanes] = (f[k] - mid[k]) / wide[k]
            lanes += 1
        terms(along, U, 0, T, A)
        n = count[r, :outer].sum()
        if outputs > 0:
            terms(across, U, 3, T, B)
            for lane in range(lanes):
                products(A, B, count[r, :outer], C, lane)
            contract(W, first[tile], C, n, outputs, out)
        for lane in range(lanes):
            tile_of[i + lane] = tile
            for k in range(outputs):
                answer[i + lane, k] = out[lane, k]
        if every:
            contract(W, first[tile] + (9 + 2 * m) * n, A, inner, m, out)
            for lane in range(lanes):
                for k in range(m):
                    nominal[i + lane, k] = out[lane, k]
        i += lanes


@entry
def follow(slopes, tile, off, out):
    """Fills out (n, k) with the slopes (t, k, 3) of their tiles times off (n, 3); rows without a tile stay as they are."""
    for i in range(tile.shape[0]):
        if tile[i] >= 0:
            v, M = part(off[i], 0), slopes[tile[i]]
            for k in range(M.shape[0]):
                out[i, k] = dot(part(M[k], 0), v)


@entry
def same_points(tips, loads, target, force, at):
    """Fills at (n,) with the row of tips, loads (k, 3) that equals target, force (n, 3), in order; -1: there is none."""
    k = 0
    for i in range(target.shape[0]):
        at[i] = -1
        for ahead in range(k, min(k + AHEAD, tips.shape[0])):
            same = True
            for j in range(3):
                same = same and tips[ahead, j] == target[i, j] and loads[ahead, j] == force[i, j]
            if same:
                at[i] = ahead
                k = ahead + 1
                break
