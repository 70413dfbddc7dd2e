"""One chain at one point, compiled: the linearised equilibrium of the loaded chain, factored.

With the end held at pose t and the platform pulling it with the wrench F, a chain with coordinates x is in equilibrium if

    J(x)^T F + (weights) = k(x),     g(x) + C F = t                             (seed eq. 1, one chain)

k = spring forces, zero for free passive joints; C = compliance given to an end that springs leave rigid. Linearised,
with A = d(k - J^T F)/dx, in the order spring coordinates, wrench, free joints:

    [ A_ss  -J_s^T  A_sq ] [dx_s]   [ J^T F + weights - k ]      Stable with its end held exactly if the elimination
    [ J_s     C     J_q  ] [dF  ] = [ t - g - C F         ]      meets as many negative pivots among the coordinates
    [ A_qs  -J_q^T  A_qq ] [dx_q]   [ J^T F + weights - k ]      as among the wrench (inertia of the bordered matrix).

Source: Pashkevich, Klimchik, Chablat, Mech. Mach. Theory 46 (2011) 662-679, loaded stiffness.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import inner
from camcomp.model.statics.kernel import pull, subtract_hessian, walk
from camcomp.model.statics.layout import (
    ACT,
    ACT_FIRST,
    ACTS,
    COUNT,
    FIRST,
    FORCE,
    KIND,
    LAST,
    MACHINE_LENGTH,
    MATRIX,
    MOVE,
    OMEGA,
    PRISMATIC,
    REST,
    REVOLUTE,
    SIZE,
    SLOT,
    SLOT_FIRST,
    SLOTS,
    SPRING,
    SPRINGS,
    STIFFNESS,
    SWING,
    VAR,
    WEIGHT,
)
from camcomp.model.statics.vectors import log_product, part

SMALLEST_PIVOT = 1e-6  # of a spring, relative to its stiffness; the next pass of Newton's method corrects the error


@inner
def add_springs(P, c, z, rho, W, M, full):
    """Subtract the spring forces of chain c from the residual; if full, add their derivatives to M.

    The last column of M keeps the stiffness alone of each spring coordinate, the scale of its pivot.
    """
    n = P.chain[c, SIZE]
    alone = n + 1 + P.chain[c, ACTS]
    for e in range(P.chain[c, FIRST], P.chain[c, LAST]):
        kind = P.element[e, KIND]
        v = P.element[e, VAR]
        k = P.value[e, STIFFNESS]
        if (kind == PRISMATIC or kind == REVOLUTE) and k > 0.0:
            a = P.element[e, ACT]
            W.residual[v] -= k * (z[v] - (rho[a] if a >= 0 else P.value[e, REST]))
            if full:
                M[v, v] += k
                M[v, alone] = k
                if a >= 0:
                    M[v, n + 1 + a - P.chain[c, ACT_FIRST]] = k
        elif kind == SPRING:
            swing = P.element[e, SWING]
            q = z[swing] if swing >= 0 else 0.0
            co = math.cos(q)
            si = math.sin(q)
            for i in range(P.element[e, COUNT]):
                for j in range(P.element[e, COUNT]):
                    p = MATRIX + 6 * i + j
                    k = P.value[e, p]
                    if swing >= 0:
                        # The energy is differentiated at this stiffness held fixed (usual virtual-joint convention);
                        # its derivative serves Newton's method and the loaded stiffness.
                        cc = P.value[e, p + 36]
                        cs = P.value[e, p + 72]
                        c1 = P.value[e, p + 108]
                        s1 = P.value[e, p + 144]
                        k += co * (co * cc + si * cs + c1) + si * s1
                        if full:
                            M[v + i, swing] += z[v + j] * (co * (co * cs + s1) - si * (2.0 * co * cc + si * cs + c1))
                    W.residual[v + i] -= k * z[v + j]
                    if full:
                        M[v + i, v + j] += k
                        if i == j:
                            M[v + i, alone] = k


@inner
def evaluate(P, c, z, rho, pose, W, full):
    """Residual of chain c with its end to be held at `pose` (12,); if full, also its linearisation, not yet factored.

    Fills W.residual and W.matrix[c] (rows as in the module's equation; columns z, residual, actuators). Returns the
    largest entry of the gap between end and pose, mm (angles times MACHINE_LENGTH).
    """
    M = W.matrix[c]
    n = P.chain[c, SIZE]
    f0 = P.chain[c, SPRINGS]
    if full:
        for i in range(n):
            for j in range(n + 1 + P.chain[c, ACTS]):
                M[i, j] = 0.0
    add_loads(P, c, z, W, M, full)
    end = W.end
    add_springs(P, c, z, rho, W, M, full)
    w = log_product(pose, end)
    gap = 0.0
    for i in range(3):
        C = P.end_compliance[c]
        W.residual[f0 + i] = pose[9 + i] - end[9 + i] - C * z[f0 + i]
        W.residual[f0 + 3 + i] = w[i] - 1e-4 * C * z[f0 + 3 + i]
        gap = max(gap, abs(W.residual[f0 + i]), MACHINE_LENGTH * abs(W.residual[f0 + 3 + i]))
        if full:
            M[f0 + i, f0 + i] += C
            M[f0 + 3 + i, f0 + 3 + i] += 1e-4 * C
    if full:
        for i in range(n):
            M[i, n] = W.residual[i]
    return gap


@inner
def add_loads(P, c, z, W, M, full):
    """Set the residual of chain c to the generalised forces of wrench and weights; if full, add their derivatives to M."""
    walk(P, c, z, W)
    for i in range(P.chain[c, SIZE]):
        W.residual[i] = 0.0
    f0 = P.chain[c, SPRINGS]
    end = W.end
    first = P.chain[c, SLOT_FIRST]
    for e in range(P.chain[c, FIRST] - 1, P.chain[c, LAST]):  # loads: the end wrench, then the weights
        if e < P.chain[c, FIRST]:
            behind = P.chain[c, SLOTS]
            at = part(end, 9)
            force = part(z, f0)
            moment = part(z, f0 + 3)
        elif P.element[e, KIND] == WEIGHT:
            frame = W.frame[e - P.chain[c, FIRST]]
            behind = P.element[e, SLOT]
            at = part(frame, 0)
            force = part(P.value[e], FORCE)
            moment = (0.0, 0.0, 0.0)
        else:
            continue
        pull(P, c, W, behind, force, moment, at)
        if not full:
            continue
        subtract_hessian(P, c, z, W, behind, M)
        if e < P.chain[c, FIRST]:
            for s in range(behind):
                v = P.slot_var[first + s]
                for i in range(3):
                    M[f0 + i, v] += W.slot[MOVE + i, s]
                    M[f0 + 3 + i, v] += W.slot[OMEGA + i, s]
                    M[v, f0 + i] -= W.slot[MOVE + i, s]
                    M[v, f0 + 3 + i] -= W.slot[OMEGA + i, s]


@inner
def factor(M, f0, n, acts):
    """Gaussian elimination of M (n, n + 1 + acts) without exchanges, the columns from n on carried along.

    Leaves the multipliers below the diagonal. f0: first wrench row. Returns the smallest pivot of a coordinate, for
    springs relative to the spring alone, for free joints to the same entry before their block was reached; negative if the
    chain is not stable with its end held, 0 if singular.
    """
    q0 = f0 + 6
    margin = 1.0
    falling = 0  # motions that release energy, less those that the held end forbids
    width = n + 1 + acts
    for j in range(n):
        if j == q0:
            for i in range(j, n):
                M[i, width] = abs(M[i, i])
        pivot = M[j, j]
        if j < f0 or j >= q0:
            least = SMALLEST_PIVOT * M[j, width]
            if abs(pivot) < least and j < f0:  # no exchanges: a spring that its load just cancels is nudged off zero
                pivot = least
                M[j, j] = least
            margin = min(margin, abs(pivot) / M[j, width])
            if pivot < 0.0:
                falling += 1
        elif pivot < 0.0:
            falling -= 1
        if not abs(pivot) > 0.0 or not math.isfinite(pivot):
            return 0.0
        for i in range(j + 1, n):
            if M[i, j] != 0.0:
                factor = M[i, j] / pivot
                M[i, j] = factor
                for k in range(j + 1, width):
                    M[i, k] -= factor * M[j, k]
    return margin if falling == 0 else -1.0


@inner
def answer(M, X, f0, n, first, last):
    """Columns first..last-1 of the chain's answers: (dF; dx_q) of the Newton step (0), platform twist (1-6), actuators.

    M factored. Loaded Cartesian stiffness of the chain = X[:6, 1:7].
    """
    for i in range(f0, n):
        x = X[i - f0]
        for k in range(first, last):
            if k == 0:
                x[k] = M[i, n]
            elif k >= 7:
                x[k] = M[i, n + k - 6]
            else:
                x[k] = 1.0 if i - f0 == k - 1 else 0.0
        for j in range(f0, i):  # the twist columns have not been carried through the elimination
            for k in range(max(first, 1), min(last, 7)):
                x[k] -= M[i, j] * X[j - f0, k]
    for i in range(n - 1, f0 - 1, -1):
        x = X[i - f0]
        for j in range(i + 1, n):
            for k in range(first, last):
                x[k] -= M[i, j] * X[j - f0, k]
        for k in range(first, last):
            x[k] /= M[i, i]


@inner
def carry(M, residual, n):
    """Takes a new residual (n,) through the elimination of the factored M into its column n."""
    for i in range(n):
        r = residual[i]
        for j in range(i):
            r -= M[i, j] * M[j, n]
        M[i, n] = r


@inner
def advance(M, X, f0, n, a0, acts, step, dz):
    """Fills dz (n,) with the chain's answer to its residual, the platform twist step[:6], its actuators' step[6 + a0:]."""
    for i in range(n - 1, -1, -1):
        if i >= f0:
            d = X[i - f0, 0]
            for k in range(6):
                d += X[i - f0, 1 + k] * step[k]
            for a in range(acts):
                d += X[i - f0, 7 + a] * step[6 + a0 + a]
        else:
            d = M[i, n]
            for a in range(acts):
                d += M[i, n + 1 + a] * step[6 + a0 + a]
            for j in range(i + 1, n):
                d -= M[i, j] * dz[j]
            d /= M[i, i]
        dz[i] = d
