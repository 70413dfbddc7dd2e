"""Inverse kinematics of the perfect rigid machine, as its controller computes them, compiled.

A chain's joint coordinates y bring its end to the platform pose; Gauss-Newton, started from the point before, keeps the
assembly mode. Position and orientation are weighed with MACHINE_LENGTH.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

from camcomp.ground.compiled import inner
from camcomp.model.statics.kernel import walk
from camcomp.model.statics.layout import (
    A_VAR,
    ACT_FIRST,
    ACTS,
    MACHINE_LENGTH,
    OMEGA,
    PLACE,
    SIZE,
    SLIDE,
    SLOT_FIRST,
    SLOTS,
)
from camcomp.model.statics.vectors import cross, get, log_product, part, plus

OK, MAX_ITERATIONS, OUT_OF_REACH, SINGULAR, UNSTABLE = 0, 2, 3, 4, 5

RIGID_STEP_DONE = (
    3e-5  # mm: after a Newton step this short the next one is below 1e-11 (step^2 over the size of a machine)
)
CLOSED = 1e-7  # mm, largest gap of a closed chain
MAX_PASSES = 60
LARGEST_RIGID_STEP = 50.0  # mm


@inner
def lu_solve(M, n, width):
    """Gaussian elimination with row exchanges: M (n, n + width) = [A | B] becomes [. | A^-1 B]. False if singular."""
    for j in range(n):
        p = j
        for i in range(j + 1, n):
            if abs(M[i, j]) > abs(M[p, j]):
                p = i
        if p != j:
            for k in range(j, n + width):
                t = M[j, k]
                M[j, k] = M[p, k]
                M[p, k] = t
        pivot = M[j, j]
        if not (abs(pivot) > 0.0 and abs(pivot) < 1e300):
            return False
        for i in range(n):
            if i != j:
                factor = M[i, j] / pivot
                for k in range(j + 1, n + width):
                    M[i, k] -= factor * M[j, k]
    for i in range(n):
        for k in range(n, n + width):
            M[i, k] /= M[i, i]
    return True


@inner
def close_chain(P, c, y, pose, W, twists):
    """Linearise the inverse kinematics of chain c at y (n,), and return the largest gap after the linear step, mm.

    Columns n..n+twists of W.solve: the step of y that closes the chain on `pose` (12,), and the rates of y per platform
    twist.
    """
    n = P.chain[c, SIZE]
    first = P.chain[c, SLOT_FIRST]
    slots = P.chain[c, SLOTS]
    J = W.jacobian
    M = W.solve
    walk(P, c, y, W)
    at = part(W.end, 9)
    w = log_product(pose, W.end)
    for i in range(3):
        J[i, n] = pose[9 + i] - W.end[9 + i]
        J[3 + i, n] = MACHINE_LENGTH * w[i]
        for j in range(n):
            J[i, j] = 0.0
            J[3 + i, j] = 0.0
    for s in range(slots):
        v = P.slot_var[first + s]
        omega = get(W.slot, OMEGA, s)
        move = plus(get(W.slot, SLIDE, s), cross(omega, plus(at, get(W.slot, PLACE, s), -1.0)), 1.0)
        for i in range(3):
            J[i, v] += move[i]
            J[3 + i, v] += MACHINE_LENGTH * omega[i]
    trace = 0.0
    for i in range(n):
        for j in range(n + 1):
            M[i, j] = 0.0
            for r in range(6):
                M[i, j] += J[r, i] * J[r, j]
        trace += M[i, i]
        for k in range(twists):
            M[i, n + 1 + k] = J[k, i] * (1.0 if k < 3 else MACHINE_LENGTH)
    for i in range(n):
        M[i, i] += 1e-13 * trace
    if not lu_solve(M, n, 1 + twists):
        return 1e300
    after = 0.0
    for r in range(6):
        gap = J[r, n]
        for j in range(n):
            gap -= J[r, j] * M[j, n]
        after = max(after, abs(gap))
    return after


@inner
def kinematics(P, pose, y, rho, W, twists):
    """Inverse kinematics: joint coordinates y (c, n), start and result, that bring every chain's end to `pose` (12,).

    Fills rho (m,) and, if twists = 6, W.rates (m, 6): actuator rates by platform twist. Returns the status.
    """
    for _ in range(MAX_PASSES):
        gap = 0.0
        size = 0.0
        for c in range(P.chain.shape[0]):
            n = P.chain[c, SIZE]
            gap = max(gap, close_chain(P, c, y[c], pose, W, twists))
            for j in range(n):
                size = max(size, abs(W.solve[j, n]) * P.scale[c, j])
            if not size < 1e200:
                return OUT_OF_REACH
            part = LARGEST_RIGID_STEP / max(size, LARGEST_RIGID_STEP)
            for j in range(n):
                y[c, j] += part * W.solve[j, n]
            for a in range(P.chain[c, ACTS]):
                v = P.actuator[P.chain[c, ACT_FIRST] + a, A_VAR]
                rho[P.chain[c, ACT_FIRST] + a] = y[c, v]
                for k in range(twists):
                    W.rates[P.chain[c, ACT_FIRST] + a, k] = W.solve[v, n + 1 + k]
        if size < RIGID_STEP_DONE:
            return OK if gap < CLOSED else OUT_OF_REACH
    return OUT_OF_REACH
