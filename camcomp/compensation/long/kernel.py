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
LANES = 64  # points of a tile that are looked up together
CACHE_LINE = 8  # numbers
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
def find_tiles(keys, values, size, centre, half, points, tile, cells):
    """Fills tile (n,) with the tiles of points (n, 3), EXACT or MISSING where there is none.

    Returns how many keys of missing cells it put into cells (n,), with repetitions only in part.
    """
    n = 0
    last = key = -1
    here = EXACT
    for i in range(points.shape[0]):
        p = part(points[i], 0)
        if here < 0 or not distance(p, part(centre[here], 0)) < half[here]:
            here, key = find_tile(keys, values, size, p[0], p[1], p[2])
        tile[i] = here
        if here == MISSING and key != last:
            cells[n] = last = key
            n += 1
    return n


@inner
def distance(p, q):
    """Largest component of the way between two points."""
    return max(abs(p[0] - q[0]), abs(p[1] - q[1]), abs(p[2] - q[2]))


@fast
def put_product(first, second, out):
    """Fills out (LANES,) with products."""
    for lane in range(LANES):
        out[lane] = first[lane] * second[lane]


@fast
def terms(degree, U, T, out):
    """Fills out (t, LANES) with the products of Chebyshev polynomials of the rows of U (3, LANES) up to a total degree, lower
    degrees first.

    T (MOST_DEGREE + 4, MOST_DEGREE + 1, LANES) is room to work in: polynomials of the rows, and behind them products of the first two.
    """
    for k in range(3):
        for lane in range(LANES):
            T[k, 0, lane], T[k, 1, lane] = 1.0, U[k, lane]
        for d in range(2, degree + 1):
            same, before, last, new = T[k, 1], T[k, d - 2], T[k, d - 1], T[k, d]
            for lane in range(LANES):
                new[lane] = 2.0 * same[lane] * last[lane] - before[lane]
    n = 0
    for total in range(degree + 1):
        for i in range(total + 1):
            put_product(T[0, i], T[1, total - i], T[3 + total, i])
        for k in range(total + 1):
            for i in range(total - k + 1):
                put_product(T[2, k], T[3 + total - k, i], out[n])
                n += 1


@fast
def add_four(u, v, w, a, t0, t1, t2):
    """Adds to t0, t1, t2 (LANES,) the sums of the rows of a (4, LANES), times u, v, w (4,) of them."""
    for lane in range(LANES):
        p, q, r, s = a[0, lane], a[1, lane], a[2, lane], a[3, lane]
        t0[lane] = t0[lane] + u[0] * p + u[1] * q + u[2] * r + u[3] * s
        t1[lane] = t1[lane] + v[0] * p + v[1] * q + v[2] * r + v[3] * s
        t2[lane] = t2[lane] + w[0] * p + w[1] * q + w[2] * r + w[3] * s


@fast
def add_products(force, t0, t1, t2, s0, s1, s2):
    """Adds to s0, s1, s2 (LANES,) the products of force (LANES,) with t0, t1, t2."""
    for lane in range(LANES):
        s0[lane] += force[lane] * t0[lane]
        s1[lane] += force[lane] * t1[lane]
        s2[lane] += force[lane] * t2[lane]


@fast
def contract(W, first, A, B, count, outputs, S, out):
    """Fills out (outputs, LANES) with sums over force terms B (nf, LANES), each times a sum over the first count (nf,) of the
    position terms A (np, LANES); coefficients from `first` on, output by output. S (3, LANES): room to work in.

    Four terms and three outputs at once: every number fetched serves several products, which then set the pace. Counts are
    multiples of four.
    """
    n = count.sum()
    for o in range(0, outputs, 3):
        u, v, w = W[first + o * n :], W[first + (o + 1) * n :], W[first + (o + 2) * n :]
        out[o : o + 3] = 0.0
        at = 0
        for b in range(count.shape[0]):
            S[:] = 0.0
            for a in range(0, count[b], 4):
                i = at + a
                add_four(u[i : i + 4], v[i : i + 4], w[i : i + 4], A[a : a + 4], S[0], S[1], S[2])
            add_products(B[b], S[0], S[1], S[2], out[o], out[o + 1], out[o + 2])
            at += count[b]


def look_up(
    rows: Ints, every: bool, target: Floats, force: Floats, answer: Floats, nominal: Floats, tile_of: Ints, *packed: Any
) -> None:
    """Answers (n, 9 + 2 m) at targets (n, 3) under forces (n, 3) in tiles tile_of (n,), for rows (k,) of them, sorted by tile.

    every: all outputs and nominal joints (n, m), or with an answer (n, 0) the joints only; otherwise correction and shift only.
    packed: those of a Field.
    """
    *_, shape, count = packed
    outputs, along, across = max(answer.shape[1], nominal.shape[1]), shape[:, 2].max(), count.shape[1]
    room = _lanes(MOST_DEGREE + 4, MOST_DEGREE + 1), *map(_lanes, (6, along, across, 3, outputs))
    look_up_rows(rows, every, target, force, answer, nominal, tile_of, *packed, *room)


def _lanes(*rows: int) -> Floats:
    """Room (*rows, LANES) that begins with a line of the cache: vectors across two of them take half as long again."""
    count = LANES * math.prod(rows)
    out = np.zeros(count + CACHE_LINE)
    begin = -(out.ctypes.data // out.itemsize) % CACHE_LINE
    return out[begin : begin + count].reshape(*rows, LANES)


@entry
def look_up_rows(rows, every, target, force, answer, nominal, tile_of, centre, half, rung, first, W, mid, wide, shape, count,
                 T, U, A, B, S, out):  # fmt: skip
    """look_up with room to work in, T and S as in `terms` and `contract`, the others (most terms or outputs, LANES)."""
    outputs, m = answer.shape[1], nominal.shape[1]
    begin = 0
    while begin < rows.shape[0]:
        tile = tile_of[rows[begin]]
        lanes = 0
        while lanes < LANES and begin + lanes < rows.shape[0] and tile_of[rows[begin + lanes]] == tile:
            i = rows[begin + lanes]
            for k in range(3):
                U[k, lanes] = (target[i, k] - centre[tile, k]) / half[tile]
                U[3 + k, lanes] = (force[i, k] - mid[k]) / wide[k]
            lanes += 1
        along, across, _, outer = shape[rung[tile]]
        of_both, of_one = count[rung[tile], :outer], shape[rung[tile], 2:3]
        terms(along, U[:3], T, A)
        terms(across, U[3:], T, B)
        contract(W, first[tile], A, B, of_both, outputs, S, out)
        for lane in range(lanes):
            for k in range(outputs):
                answer[rows[begin + lane], k] = out[k, lane]
        if every:
            contract(W, first[tile] + (9 + 2 * m) * of_both.sum(), A, B, of_one, m, S, out)
            for lane in range(lanes):
                for k in range(m):
                    nominal[rows[begin + lane], k] = out[k, lane]
        begin += lanes


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
