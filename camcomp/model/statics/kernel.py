"""One chain at one point, compiled: its pose, the velocities of its slots, and the generalised forces of loads.

The Hessian of a load (F; M) is taken as the derivative of J^T (F; M), which under moments is not symmetric.
Rotations of springs are rotation vectors; their left Jacobian and its derivative follow Sola, Deray, Atchuthan, "A micro
Lie theory for state estimation in robotics", eqs. (132)-(145).
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import inner
from camcomp.model.statics.layout import (
    AHEAD,
    AXIS,
    BEHIND,
    COMP,
    COUNT,
    FIRST,
    FIXED,
    KIND,
    LAST,
    MOMENT,
    MOVE,
    OMEGA,
    PLACE,
    PRISMATIC,
    REVOLUTE,
    SIGN,
    SLIDE,
    SLOT,
    SLOT_FIRST,
    SPRING,
    VAR,
    VECTOR,
    WEIGHT,
)
from camcomp.model.statics.vectors import (
    add_to,
    coefficients,
    column,
    cross,
    dot,
    get,
    part,
    plus,
    put,
    rolled,
    set_columns,
    turned,
    turned_back,
    unit,
)


@inner
def unpack_spring(P, e, z, xi):
    """Fills xi (6,) = translation and rotation vector of spring e."""
    for k in range(6):
        xi[k] = 0.0
    for i in range(P.element[e, COUNT]):
        xi[P.element[e, COMP + i]] = z[P.element[e, VAR] + i]


@inner
def walk(P, c, z, W):
    """Forward kinematics of chain c: fills OMEGA, SLIDE, PLACE of its slots, W.frame, and the end pose W.end."""
    T = W.end
    S = W.slot
    rest = (0.0, 0.0, 0.0)
    for i in range(9, 12):
        T[i] = 0.0
    set_columns(T, unit(0), unit(1), unit(2))
    for e in range(P.chain[c, FIRST], P.chain[c, LAST]):
        kind = P.element[e, KIND]
        s = P.element[e, SLOT]
        value = P.value[e]
        frame = W.frame[e - P.chain[c, FIRST]]
        if kind == PRISMATIC or kind == REVOLUTE:
            q = value[SIGN] * z[P.element[e, VAR]]
            k = P.element[e, AXIS]
            axis = column(T, k)
            rate = plus(rest, axis, value[SIGN])
            put(S, PLACE, s, part(T, 9))
            put(S, OMEGA, s, rate if kind == REVOLUTE else rest)
            put(S, SLIDE, s, rest if kind == REVOLUTE else rate)
            if kind == PRISMATIC:
                add_to(T, 9, plus(rest, axis, q))
            else:
                co = math.cos(q)
                si = math.sin(q)
                j = (k + 1) % 3
                k = (k + 2) % 3
                for i in range(0, 9, 3):
                    a = T[i + j]
                    b = T[i + k]
                    T[i + j] = co * a + si * b
                    T[i + k] = co * b - si * a
        elif kind == SPRING:
            for i in range(9):
                frame[i] = T[i]
            unpack_spring(P, e, z, W.spring)
            w = part(W.spring, 3)
            add_to(T, 9, turned(T, part(W.spring, 0)))
            a, b, d, _, _ = coefficients(dot(w, w))
            for i in range(P.element[e, COUNT]):
                k = P.element[e, COMP + i]
                axis = turned(T, rolled(w, unit(k - 3), b, d)) if k >= 3 else column(T, k)
                put(S, PLACE, s + i, part(T, 9))
                put(S, OMEGA, s + i, axis if k >= 3 else rest)
                put(S, SLIDE, s + i, rest if k >= 3 else axis)
            x = turned(T, rolled(w, unit(0), a, b))
            y = turned(T, rolled(w, unit(1), a, b))
            set_columns(T, x, y, turned(T, rolled(w, unit(2), a, b)))
        else:
            shift = turned(T, part(value, VECTOR))
            if kind == WEIGHT:
                for i in range(3):
                    frame[i] = T[9 + i] + shift[i]
            else:
                add_to(T, 9, shift)
            if kind == FIXED:
                set_columns(T, turned(T, column(value, 0)), turned(T, column(value, 1)), turned(T, column(value, 2)))


@inner
def pull(P, c, W, n, f, m, at):
    """Add J^T (f; m) of a load, force f and moment m at the position `at`, on the first n slots to the residual.

    Fills MOVE, MOMENT, AHEAD, BEHIND of the slots; the load's Hessian is, for slots a and b,
    h_ab = AHEAD_a . MOVE_b if b is not before a, BEHIND_a . OMEGA_b if b is before a.
    """
    S = W.slot
    for s in range(n):
        omega = get(S, OMEGA, s)
        slide = get(S, SLIDE, s)
        lever = plus(at, get(S, PLACE, s), -1.0)
        moment = plus(m, cross(lever, f), 1.0)
        ahead = cross(f, omega)
        put(S, MOVE, s, plus(slide, cross(omega, lever), 1.0))
        put(S, MOMENT, s, moment)
        put(S, AHEAD, s, ahead)
        put(S, BEHIND, s, plus(plus(cross(omega, moment), cross(lever, ahead), 1.0), cross(slide, f), 1.0))
        W.residual[P.slot_var[P.chain[c, SLOT_FIRST] + s]] += dot(omega, moment) + dot(slide, f)


@inner
def subtract_hessian(P, c, z, W, n, M):
    """Subtracts the Hessian of the load last given to `pull` from M."""
    S = W.slot
    first = P.chain[c, SLOT_FIRST]
    for a in range(n):
        row = M[P.slot_var[first + a]]
        ahead = get(S, AHEAD, a)
        behind = get(S, BEHIND, a)
        for b in range(n):
            row[P.slot_var[first + b]] -= dot(behind, get(S, OMEGA, b)) if b < a else dot(ahead, get(S, MOVE, b))
    for e in range(P.chain[c, FIRST], P.chain[c, LAST]):
        s = P.element[e, SLOT]
        count = P.element[e, COUNT]
        if P.element[e, KIND] != SPRING or s + count > n:
            continue
        # The rotations of one spring turn each other's axes, by the derivative of J_l^T mu, mu = moment in its frame.
        unpack_spring(P, e, z, W.spring)
        w = part(W.spring, 3)
        mu = turned_back(W.frame[e - P.chain[c, FIRST]], get(S, MOMENT, s + count - 1))
        _, b, d, db, dd = coefficients(dot(w, w))
        wmu = cross(w, mu)
        wwmu = cross(w, wmu)
        for j in range(count):
            q = P.element[e, COMP + j] - 3
            if q < 0:
                continue
            along = unit(q)
            turn = plus(cross(along, wmu), cross(w, cross(along, mu)), 1.0)
            g = plus(plus((0.0, 0.0, 0.0), cross(mu, along), b), turn, d)
            g = plus(plus(g, wmu, -db * w[q]), wwmu, dd * w[q])
            for i in range(count):
                k = P.element[e, COMP + i] - 3
                if k < 0:
                    continue
                h = g[k]
                if j < i:  # in place of BEHIND . OMEGA
                    h += dot(get(S, AHEAD, s + i), get(S, MOVE, s + j)) - dot(
                        get(S, BEHIND, s + i), get(S, OMEGA, s + j)
                    )
                M[P.slot_var[first + s + i], P.slot_var[first + s + j]] -= h
