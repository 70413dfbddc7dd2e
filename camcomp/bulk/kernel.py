"""The inner loops of long programs, compiled: forces along straight moves, and interpolation inside tiles.

The forces are those of cutting/track.py; tests hold both ways against each other. The interpolation is by Chebyshev
polynomials in the position times Chebyshev polynomials in the force. All of it stands in one file, because numba only
sees a change in the file of the function that it kept compiled.

A tile is a cube. Its coefficients W hold output by output the terms of the outputs that depend on both, and behind them
those of the joints, which depend on the position alone. A force term of a higher degree goes with position terms of
lower degrees only, `count` of them: the first ones.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import numpy as np
from numba import njit

from camcomp.datatypes import RAPID

MISSING, SPLIT, EXACT = -3, -1, -2  # what a cell can be besides a tile
LEVELS = 6
BIAS = 1 << 17  # cells are counted from here; 2**18 of them per axis
LANES = 4  # points that are looked up together
MOST = 8  # highest degree that the evaluation has room for
BASIC = 6  # outputs that are always asked for: correction (3), shift (3); then tilt (3), drives (m), change of the joints (m)


def exponents(degree: int) -> np.ndarray:
    """Exponents (t, 3) of all products up to a total degree, lower degrees first, in the order of `terms`."""
    rows = [(i, total - k - i, k) for total in range(degree + 1) for k in range(total + 1) for i in range(total - k + 1)]
    return np.array(rows, np.int64)


@njit(cache=True, nogil=True)
def cell_key(level, x, y, z, size):
    """Number of the cell of a level that holds a point; -1 when it lies out of every range."""
    s = size / (1 << level)
    i = int(np.floor(x / s)) + BIAS
    j = int(np.floor(y / s)) + BIAS
    k = int(np.floor(z / s)) + BIAS
    top = 2 * BIAS
    if i < 0 or j < 0 or k < 0 or i >= top or j >= top or k >= top:
        return -1
    return (((level * top) + i) * top + j) * top + k


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def terms(degree, u, v, w, T, out, lane):
    """Fills out[lane] (t,) with the products of Chebyshev polynomials at u, v, w up to a total degree, lower degrees first.

    T (MOST + 4, MOST + 1) is room to work in: polynomials of u, v and w, and behind them products of those of u and v.
    """
    T[0, 0] = 1.0
    T[1, 0] = 1.0
    T[2, 0] = 1.0
    T[0, 1] = u
    T[1, 1] = v
    T[2, 1] = w
    for d in range(2, degree + 1):
        T[0, d] = 2.0 * u * T[0, d - 1] - T[0, d - 2]
        T[1, d] = 2.0 * v * T[1, d - 1] - T[1, d - 2]
        T[2, d] = 2.0 * w * T[2, d - 1] - T[2, d - 2]
    n = 0
    for total in range(degree + 1):
        for i in range(total + 1):
            T[3 + total, i] = T[0, i] * T[1, total - i]
        for k in range(total + 1):
            for i in range(total - k + 1):
                out[lane, n] = T[2, k] * T[3 + total - k, i]
                n += 1


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
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


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
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


@njit(cache=True, nogil=True)
def path_force(t, axis, components, out):
    """Fills out (3,) with the force of components (Fr, Ft, Fz) for the unit feed direction t; False on a plunge."""
    along = t[0] * axis[0] + t[1] * axis[1] + t[2] * axis[2]
    x, y, z = t[0] - along * axis[0], t[1] - along * axis[1], t[2] - along * axis[2]
    size = np.sqrt(x * x + y * y + z * z)
    if not size > 1e-6:
        out[:] = 0.0
        return False
    x, y, z = x / size, y / size, z / size
    right = (y * axis[2] - z * axis[1], z * axis[0] - x * axis[2], x * axis[1] - y * axis[0])
    out[0] = components[0] * right[0] + components[1] * x + components[2] * axis[0]
    out[1] = components[0] * right[1] + components[1] * y + components[2] * axis[1]
    out[2] = components[0] * right[2] + components[1] * z + components[2] * axis[2]
    return True


@njit(cache=True, nogil=True)
def lay_loads(kind, start, end, axis, components, join_cosine, f0, f1, jump, length):
    """Forces at the start and the end of moves (n,), where they jump, and the lengths: track.py for constant components.

    A feed move without length keeps the force before it.
    """
    n = kind.shape[0]
    before = -1  # the last move that counts
    t = np.zeros(3)
    last = np.zeros(3)
    middle = np.zeros(3)
    own = np.zeros(3)
    own_before = np.zeros(3)
    cut_before = False
    corner = np.zeros(3)
    for i in range(n):
        jump[i] = False
        for k in range(3):
            t[k] = end[i, k] - start[i, k]
        size = np.sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
        length[i] = size
        if not size > 0.0 and kind[i] != RAPID:
            for k in range(3):
                f0[i, k] = f1[before, k] if before >= 0 else 0.0
                f1[i, k] = f0[i, k]
            continue
        cuts = False
        own[:] = 0.0
        if size > 0.0:
            t /= size
            if kind[i] != RAPID:
                cuts = path_force(t, axis, components, own)
        f0[i] = own
        f1[i] = own
        if before >= 0:
            cosine = last[0] * t[0] + last[1] * t[1] + last[2] * t[2]
            if cuts and cut_before and cosine >= join_cosine:
                for k in range(3):
                    middle[k] = last[k] + t[k]
                middle /= np.sqrt(middle[0] * middle[0] + middle[1] * middle[1] + middle[2] * middle[2])
                path_force(middle, axis, components, corner)
                f1[before] = corner
                f0[i] = corner
                for j in range(before + 1, i):  # moves without length in between
                    f0[j] = corner
                    f1[j] = corner
            else:
                change = 0.0
                for k in range(3):
                    change += (own[k] - own_before[k]) ** 2
                jump[i] = np.sqrt(change) > 1e-9
        before = i
        last[:] = t
        own_before[:] = own
        cut_before = cuts


@njit(cache=True, nogil=True, error_model="numpy")
def look_up(a, b, m, every, target, force, answer, nominal, tile_of, size, keys, values, centre, half, rung, first, W, mid, wide,
            shape, count):  # fmt: skip
    """Answers (n, 9 + 2 m) at targets (n, 3) under forces (n, 3) for rows a to b; tile_of (n,), negative: there is none.

    every: all outputs and nominal joints (n, m); otherwise correction and shift only. From `size` on: Field.packed.
    """
    room = np.empty((MOST + 4, MOST + 1))
    A = np.zeros((LANES, shape[:, 2].max()))
    B = np.zeros((LANES, count.shape[1]))
    C = np.zeros((LANES, A.shape[1] * B.shape[1]))
    outputs = 9 + 2 * m if every else BASIC
    out = np.zeros((LANES, outputs))
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
            terms(along, x / h, y / h, z / h, room, A, lanes)
            terms(across, (f[0] - mid[0]) / wide[0], (f[1] - mid[1]) / wide[1], (f[2] - mid[2]) / wide[2], room, B, lanes)
            n = products(A, B, count[r, :outer], C, lanes)
            lanes += 1
        contract(W, first[tile], C, n, outputs, out)
        for lane in range(lanes):
            tile_of[i + lane] = tile
            for k in range(outputs):
                answer[i + lane, k] = out[lane, k]
        if every:
            contract(W, first[tile] + outputs * n, A, inner, m, out)
            for lane in range(lanes):
                for k in range(m):
                    nominal[i + lane, k] = out[lane, k]
        i += lanes
