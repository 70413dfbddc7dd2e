"""One chain at one point, compiled: pose, Jacobian, Hessian, and the linearised equilibrium of the loaded chain.

Variables x of a chain are its joint coordinates (an actuator's: commanded value plus spring deflection) and its
spring deflections. With the end held at pose t and the platform pulling the end with the wrench F, equilibrium is

    J(x)^T F + (weights) = k(x),     g(x) = t                                   (seed eq. 1, one chain)

k = spring forces, zero for free passive joints. Every routine works on preallocated arrays of one point.
"Slots" are the one-dof motions along the chain, base to end: a joint is one slot, a 6-dof spring up to six.
Source of the linearisation: Pashkevich, Klimchik, Chablat, Mech. Mach. Theory 46 (2011) 662-679 (loaded stiffness);
Hessian taken as the derivative of J^T F, which under moments is not symmetric.
"""

import math

import numpy as np
from numba import njit

from camcomp.statics.pack import FIXED, PRISMATIC, REVOLUTE, SPRING
from camcomp.statics.rotation import (
    cross_matrix,
    exp_rotation,
    left_jacobian,
    left_jacobian_derivative,
    log_rotation,
)


@njit(cache=True, nogil=True, error_model="numpy")
def _cross(a, b):
    out = np.empty(3)
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, nogil=True, error_model="numpy")
def _mul(A, b):
    out = np.empty(3)
    for i in range(3):
        out[i] = A[i, 0] * b[0] + A[i, 1] * b[1] + A[i, 2] * b[2]
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _mul33(A, B):
    out = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def new_slots(P, c):
    """Empty slot arrays of chain c.

    turn (s,) 1 = rotation; axis, point (s, 3) world; frame (s, 3, 3) in front of the owning spring; var (s,),
    sign (s,): variable -> slot rate; elem (s,) owner. Weights, per element of the chain: point of attack (3,) and
    the number of slots it hangs behind (-1: no weight).
    """
    n = 0
    for e in range(P.first[c], P.first[c + 1]):
        if P.kind[e] == PRISMATIC or P.kind[e] == REVOLUTE:
            n += 1
        elif P.kind[e] == SPRING:
            n += P.count[e]
    ne = P.first[c + 1] - P.first[c]
    return (
        np.empty(n, np.int64),
        np.empty((n, 3)),
        np.empty((n, 3)),
        np.empty((n, 3, 3)),
        np.empty(n, np.int64),
        np.empty(n),
        np.empty(n, np.int64),
        np.empty((ne, 3)),
        np.full(ne, -1),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def walk(P, c, x, slots):
    """Forward kinematics of chain c at its variables x; fills the slots, returns the end pose (R, p)."""
    turn, axis, point, frame, var, sign, elem, weight_at, weight_behind = slots
    R = np.eye(3)
    p = np.zeros(3)
    s = 0
    for e in range(P.first[c], P.first[c + 1]):
        kind = P.kind[e]
        if kind == FIXED:
            p = p + _mul(R, P.vector[e])
            R = _mul33(R, P.rotation[e])
        elif kind == PRISMATIC or kind == REVOLUTE:
            a = _mul(R, P.vector[e])
            axis[s] = a
            point[s] = p
            turn[s] = 1 if kind == REVOLUTE else 0
            var[s] = P.var[e]
            sign[s] = P.sign[e]
            elem[s] = e
            s += 1
            value = P.sign[e] * x[P.var[e]]
            if kind == REVOLUTE:
                R = _mul33(R, exp_rotation(P.vector[e] * value))
            else:
                p = p + a * value
        elif kind == SPRING:
            u, w = deflection(P, e, x)
            p = p + _mul(R, u)
            Jl = left_jacobian(w)
            for i in range(P.count[e]):
                k = P.comp[e, i]
                var[s] = P.var[e] + i
                sign[s] = 1.0
                elem[s] = e
                point[s] = p
                frame[s] = R
                if k < 3:
                    turn[s] = 0
                    for r in range(3):
                        axis[s, r] = R[r, k]
                else:
                    turn[s] = 1
                    axis[s] = _mul(R, Jl[:, k - 3])
                s += 1
            R = _mul33(R, exp_rotation(w))
        else:
            weight_at[e - P.first[c]] = p + _mul(R, P.vector[e])
            weight_behind[e - P.first[c]] = s
    return R, p


@njit(cache=True, nogil=True, error_model="numpy")
def deflection(P, e, x):
    """Translation (3,) and rotation vector (3,) of spring e."""
    u = np.zeros(3)
    w = np.zeros(3)
    for i in range(P.count[e]):
        k = P.comp[e, i]
        if k < 3:
            u[k] = x[P.var[e] + i]
        else:
            w[k - 3] = x[P.var[e] + i]
    return u, w


@njit(cache=True, nogil=True, error_model="numpy")
def jacobian(J, p_end, slots):
    """Fills J (6, nv): end twist (translation; rotation, world) per variable."""
    turn, axis, point, _, var, sign, _, _, _ = slots
    J[:] = 0.0
    for s in range(turn.shape[0]):
        v = var[s]
        if turn[s]:
            lin = _cross(axis[s], p_end - point[s])
            for r in range(3):
                J[r, v] += sign[s] * lin[r]
                J[3 + r, v] += sign[s] * axis[s, r]
        else:
            for r in range(3):
                J[r, v] += sign[s] * axis[s, r]


@njit(cache=True, nogil=True, error_model="numpy")
def add_load(P, x, slots, n, f, m, at, g, H):
    """Adds J^T (f; m) of a wrench acting at `at` behind the first n slots to g, and its derivative to H."""
    turn, axis, point, frame, var, sign, elem, _, _ = slots
    moment = np.empty((n, 3))  # moment of the wrench about each slot
    shift = np.empty((n, 3))  # motion of `at` per unit of the slot
    for a in range(n):
        lever = at - point[a]
        moment[a] = m + _cross(lever, f)
        if turn[a]:
            g[var[a]] += sign[a] * _dot(axis[a], moment[a])
            shift[a] = _cross(axis[a], lever)
        else:
            g[var[a]] += sign[a] * _dot(axis[a], f)
            shift[a] = axis[a]
    for a in range(n):
        for b in range(n):
            if turn[a] and turn[b] and elem[a] == elem[b] and P.kind[elem[a]] == SPRING:
                continue  # the rotations of one spring: below
            if b >= a:  # b moves only what lies behind a
                if not turn[a]:
                    continue
                h = _dot(axis[a], _cross(shift[b], f))
            elif not turn[b]:  # b carries a along without turning it
                continue
            elif not turn[a]:
                h = _dot(_cross(axis[b], axis[a]), f)
            else:
                lever = at - point[a]
                h = _dot(_cross(axis[b], axis[a]), moment[a]) + _dot(axis[a], _cross(_cross(axis[b], lever), f))
            H[var[a], var[b]] += sign[a] * sign[b] * h
    s = 0
    while s < n:
        e = elem[s]
        if P.kind[e] != SPRING:
            s += 1
            continue
        _, w = deflection(P, e, x)
        D = left_jacobian_derivative(w)
        for i in range(P.count[e]):
            for j in range(P.count[e]):
                k = P.comp[e, i] - 3
                q = P.comp[e, j] - 3
                if k >= 0 and q >= 0:  # the axis of k turns with component q by the derivative of J_l
                    turned = _mul(frame[s], D[q][:, k])
                    h = _dot(turned, moment[s + i]) + _dot(axis[s + i], _cross(shift[s + j], f))
                    H[var[s + i], var[s + j]] += h
        s += P.count[e]


@njit(cache=True, nogil=True, error_model="numpy")
def springs(P, c, x, rho, k, Kx):
    """Adds the spring forces of chain c to k (nv,) and their derivative to Kx (nv, nv)."""
    for e in range(P.first[c], P.first[c + 1]):
        kind = P.kind[e]
        if kind == PRISMATIC or kind == REVOLUTE:
            if P.joint_stiffness[e] > 0.0:
                rest = rho[P.act[e]] if P.act[e] >= 0 else P.rest[e]
                k[P.var[e]] += P.joint_stiffness[e] * (x[P.var[e]] - rest)
                Kx[P.var[e], P.var[e]] += P.joint_stiffness[e]
        elif kind == SPRING:
            n = P.count[e]
            v = P.var[e]
            K = P.stiffness[e]
            if P.swing[e] >= 0:
                q = x[P.swing[e]]
                K, dK = parallelogram_stiffness(P.stiffness[e], P.hinge[e], P.offset[e], q)
                for i in range(n):
                    for j in range(n):
                        Kx[v + i, P.swing[e]] += dK[P.comp[e, i], P.comp[e, j]] * x[v + j]
            for i in range(n):
                for j in range(n):
                    value = K[P.comp[e, i], P.comp[e, j]]
                    k[v + i] += value * x[v + j]
                    Kx[v + i, v + j] += value


@njit(cache=True, nogil=True, error_model="numpy")
def parallelogram_stiffness(bar, hinge, offset, q):
    """Stiffness (6, 6) of two hinged bars at +-offset of the cross-bar, in the arm's frame, and its derivative by q.

    K(q) = sum X^T K_bar X with X the shift from cross-bar centre to bar end: 2 (K_bar + E^T K_bar E).
    The energy is differentiated at K held fixed (usual virtual-joint convention); the derivative serves Newton.
    """
    r = _mul(exp_rotation(-q * hinge), offset)
    dr = -_cross(hinge, r)
    E = -cross_matrix(r)
    dE = -cross_matrix(dr)
    B = bar[:3, :3].copy()
    K = 2.0 * bar
    dK = np.zeros((6, 6))
    K[3:, 3:] += 2.0 * (E.T.copy() @ B @ E)
    dK[3:, 3:] += 2.0 * (dE.T.copy() @ B @ E + E.T.copy() @ B @ dE)
    return K, dK


@njit(cache=True, nogil=True, error_model="numpy")
def chain_state(P, c, x, rho, F, R_t, p_t, J, A, residual, gap):
    """Equilibrium residual of chain c held at pose (R_t, p_t) with end wrench F (6,), and its derivatives.

    Fills J (6, nv), A (nv, nv) = d(k - J^T F)/dx, residual (nv,) = J^T F + weights - k, gap (6,) = t - g(x) - C F.
    """
    slots = new_slots(P, c)
    n = slots[0].shape[0]
    R_e, p_e = walk(P, c, x, slots)
    jacobian(J, p_e, slots)
    nv = P.nvar[c]
    H = np.zeros((nv, nv))
    k = np.zeros(nv)
    residual[:] = 0.0
    A[:] = 0.0
    add_load(P, x, slots, n, F[:3], F[3:], p_e, residual, H)
    weight_at, weight_behind = slots[7], slots[8]
    for i in range(weight_behind.shape[0]):
        if weight_behind[i] >= 0:
            force = P.force[P.first[c] + i]
            add_load(P, x, slots, weight_behind[i], force, np.zeros(3), weight_at[i], residual, H)
    springs(P, c, x, rho, k, A)
    for i in range(nv):
        residual[i] -= k[i]
        for j in range(nv):
            A[i, j] -= H[i, j]
    C = P.end_compliance[c]
    w = log_rotation(_mul33(R_t, R_e.T))
    for i in range(3):
        gap[i] = p_t[i] - p_e[i] - C * F[i]
        gap[3 + i] = w[i] - C * 1e-4 * F[3 + i]


@njit(cache=True, nogil=True, error_model="numpy")
def lu_solve(M, B):
    """Solves M X = B in place by Gaussian elimination with partial pivoting; X lands in B. False if singular."""
    n = M.shape[0]
    nb = B.shape[1]
    for j in range(n):
        p = j
        best = abs(M[j, j])
        for i in range(j + 1, n):
            if abs(M[i, j]) > best:
                best = abs(M[i, j])
                p = i
        if not best > 0.0 or not math.isfinite(best):
            return False
        if p != j:
            for k in range(j, n):
                t = M[j, k]
                M[j, k] = M[p, k]
                M[p, k] = t
            for k in range(nb):
                t = B[j, k]
                B[j, k] = B[p, k]
                B[p, k] = t
        inv = 1.0 / M[j, j]
        for i in range(j + 1, n):
            if M[i, j] != 0.0:
                factor = M[i, j] * inv
                for k in range(j + 1, n):
                    M[i, k] -= factor * M[j, k]
                for k in range(nb):
                    B[i, k] -= factor * B[j, k]
    for j in range(n - 1, -1, -1):
        inv = 1.0 / M[j, j]
        for k in range(nb):
            B[j, k] *= inv
        for i in range(j):
            if M[i, j] != 0.0:
                for k in range(nb):
                    B[i, k] -= M[i, j] * B[j, k]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def chain_response(P, c, x, rho, F, R_t, p_t):
    """Newton response of chain c: how its variables and end wrench answer to the gap, the end pose and its actuators.

    Returns (ok, X, size): X (nv + 6, 7 + na) rows = (dx; dF), columns = (Newton step, d/d pose (6), d/d rho of this
    chain's actuators in order); size = (largest gap mm, largest force residual N). Loaded Cartesian stiffness of the
    chain = X[nv:, 1:7].
    """
    nv = P.nvar[c]
    J = np.zeros((6, nv))
    A = np.zeros((nv, nv))
    residual = np.zeros(nv)
    gap = np.zeros(6)
    chain_state(P, c, x, rho, F, R_t, p_t, J, A, residual, gap)
    na = 0
    for a in range(P.act_chain.shape[0]):
        if P.act_chain[a] == c:
            na += 1
    M = np.zeros((nv + 6, nv + 6))
    B = np.zeros((nv + 6, 7 + na))
    for i in range(nv):
        for j in range(nv):
            M[i, j] = -A[i, j]
        for r in range(6):
            M[i, nv + r] = J[r, i]
            M[nv + r, i] = J[r, i]
        B[i, 0] = -residual[i]
    for r in range(6):
        M[nv + r, nv + r] = P.end_compliance[c] * (1.0 if r < 3 else 1e-4)
        B[nv + r, 0] = gap[r]
        B[nv + r, 1 + r] = 1.0
    col = 7
    for a in range(P.act_chain.shape[0]):
        if P.act_chain[a] == c:
            for e in range(P.first[c], P.first[c + 1]):
                if P.act[e] == a:
                    B[P.act_var[a], col] = -P.joint_stiffness[e]
            col += 1
    ok = lu_solve(M, B)
    return ok, B, np.max(np.abs(gap)), np.max(np.abs(residual))
