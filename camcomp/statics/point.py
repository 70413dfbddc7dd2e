"""The whole machine at one point, compiled: all chains, their common platform, and what is asked for.

One Newton iteration linearises every chain (kernel.chain_response), eliminates the chains' own variables, and solves a
6 x 6 system for the machine. The unknowns depend on the mode:

    FREE     rho given, force given       -> pose                     tF = f^-1(F | t0), seed eq. (1)
    HOLD     rho given, tip given         -> tilt, holding force      F = f(t | t0), seed eq. (1)
    TARGET   tip given, force given       -> tilt, commanded tip      F = f(t0 | t0F), seed eqs. (2)-(3)
    CLAMP    rho given, pose given        -> wrench (6,)              f(t | t0) with the full pose held
    POSE     pose given, force given      -> commanded pose           TARGET without tilt; needs six actuators
"""

import numpy as np
from numba import njit

from camcomp.statics.kernel import (
    _cross,
    _mul,
    _mul33,
    chain_response,
    chain_state,
    jacobian,
    lu_solve,
    new_slots,
    walk,
)
from camcomp.statics.pack import LENGTH
from camcomp.statics.rotation import cross_matrix, exp_rotation, log_rotation

FREE, HOLD, TARGET, CLAMP, POSE = 0, 1, 2, 3, 4
OK, MAX_ITERATIONS, OUT_OF_REACH, SINGULAR, UNSTABLE = 0, 2, 3, 4, 5

STEP_DONE = 1e-6  # mm: after a Newton step this short the next one is below 1e-12
GAP_DONE = 1e-10  # mm
MAX_PASSES = 60
MAX_TURN = 0.3  # rad, longest rotation in one step
LARGEST_STEP = 50.0  # mm


@njit(cache=True, nogil=True, error_model="numpy")
def rigid_kinematics(P, R_t, p_t, rho, y):
    """Inverse kinematics of the rigid machine: joint coordinates y (c, nv) that bring every chain's end to the pose.

    Gauss-Newton from the y given (previous point or start pose). Fills rho (m,). Returns (status, passes).
    """
    worst = 0
    for c in range(P.nvar.shape[0]):
        nv = P.nvar[c]
        slots = new_slots(P, c)
        J = np.zeros((6, nv))
        done = False
        for step in range(MAX_PASSES):
            R_e, p_e = walk(P, c, y[c], slots)
            jacobian(J, p_e, slots)
            w = log_rotation(_mul33(R_t, R_e.T))
            gap = np.empty(6)
            for i in range(3):
                gap[i] = p_t[i] - p_e[i]
                gap[3 + i] = w[i] * LENGTH
                for j in range(nv):
                    J[3 + i, j] *= LENGTH
            M = J.T.copy() @ J
            B = np.zeros((nv, 1))
            for j in range(nv):
                for i in range(6):
                    B[j, 0] += J[i, j] * gap[i]
            gradient = np.max(np.abs(B))
            trace = 0.0
            for j in range(nv):
                trace += M[j, j]
            for j in range(nv):
                M[j, j] += 1e-13 * trace
            if not lu_solve(M, B):
                return SINGULAR, step
            size = 0.0
            for j in range(nv):
                size = max(size, abs(B[j, 0]) * np.sqrt(J[0, j] ** 2 + J[1, j] ** 2 + J[2, j] ** 2 + J[3, j] ** 2 + J[4, j] ** 2 + J[5, j] ** 2))
            limit = LARGEST_STEP / max(size, LARGEST_STEP)
            for j in range(nv):
                y[c, j] += limit * B[j, 0]
            worst = max(worst, step + 1)
            if size < STEP_DONE:
                R_e, p_e = walk(P, c, y[c], slots)
                w = log_rotation(_mul33(R_t, R_e.T))
                left = 0.0
                for i in range(3):
                    left = max(left, abs(p_t[i] - p_e[i]), LENGTH * abs(w[i]))
                if left < 1e-7:
                    done = True
                    break
                if left >= 1e-7 and gradient < 1e-4:
                    return OUT_OF_REACH, worst
        if not done:
            return OUT_OF_REACH, worst
    for a in range(P.act_var.shape[0]):
        rho[a] = y[P.act_chain[a], P.act_var[a]]
    return OK, worst


@njit(cache=True, nogil=True, error_model="numpy")
def rigid_rates(P, y, rates):
    """Fills rates (m, 6): actuator velocities per platform twist of the rigid machine (inverse Jacobian)."""
    for c in range(P.nvar.shape[0]):
        nv = P.nvar[c]
        slots = new_slots(P, c)
        J = np.zeros((6, nv))
        _, p_e = walk(P, c, y[c], slots)
        jacobian(J, p_e, slots)
        J[3:] *= LENGTH
        M = J.T.copy() @ J
        trace = 0.0
        for j in range(nv):
            trace += M[j, j]
        for j in range(nv):
            M[j, j] += 1e-13 * trace
        B = J.T.copy()
        B[:, 3:] *= LENGTH
        if not lu_solve(M, B):
            return False
        for a in range(P.act_var.shape[0]):
            if P.act_chain[a] == c:
                rates[a] = B[P.act_var[a]]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def positive_definite(M):
    """True if the symmetric part of M is positive definite (Cholesky, pivots above round-off of the scaled matrix)."""
    n = M.shape[0]
    L = np.zeros((n, n))
    scale = np.empty(n)
    for i in range(n):
        if not M[i, i] > 0.0:
            return False
        scale[i] = 1.0 / np.sqrt(M[i, i])
    for j in range(n):
        for i in range(j, n):
            value = 0.5 * (M[i, j] + M[j, i]) * scale[i] * scale[j]
            for k in range(j):
                value -= L[i, k] * L[j, k]
            if i == j:
                if not value > 1e-13:
                    return False
                L[i, i] = np.sqrt(value)
            else:
                L[i, j] = value / L[j, j]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def chains_stable(P, x, rho, F, R, p):
    """True if every chain is in stable equilibrium with its end held (second variation positive).

    The second variation need only be positive on motions that keep the end: by Finsler's lemma A + gamma J^T J is
    positive definite for a large gamma exactly then.
    """
    for c in range(P.nvar.shape[0]):
        nv = P.nvar[c]
        J = np.zeros((6, nv))
        A = np.zeros((nv, nv))
        residual = np.zeros(nv)
        gap = np.zeros(6)
        chain_state(P, c, x[c], rho, F[c], R, p, J, A, residual, gap)
        for i in range(nv):
            for j in range(nv):
                a = 0.0
                for r in range(3):
                    a += J[r, i] * J[r, j] + LENGTH * LENGTH * J[3 + r, i] * J[3 + r, j]
                A[i, j] += 1e9 * a
        if not positive_definite(A):
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def to_structure(joint_var, y, rho, x, F, P):
    """Cold start of the elastic machine: joints from the rigid solution y, springs relaxed, no wrench."""
    for c in range(joint_var.shape[0]):
        for j in range(P.nvar[c]):
            x[c, j] = 0.0
        for j in range(joint_var.shape[1]):
            if joint_var[c, j] >= 0:
                x[c, joint_var[c, j]] = y[c, j]
        for r in range(6):
            F[c, r] = 0.0
    for a in range(P.act_var.shape[0]):
        x[P.act_chain[a], P.act_var[a]] = rho[a]


@njit(cache=True, nogil=True, error_model="numpy")
def solve_point(mode, P, rigid, tool, R_aim, tip_aim, force, wrench, rho, y, x, F, R, p, tip_cmd, R_cmd):
    """Newton on the whole machine at one point; every array argument from rho on is start value and result.

    R_aim (3, 3), tip_aim (3,): pose asked for (HOLD, TARGET, CLAMP). force (3,) at the tip and wrench (6,) at the
    platform reference, machine axes. rho (m,), y/x/F per chain, R, p platform pose, tip_cmd, R_cmd commanded pose.
    Returns (status, passes).
    """
    m = rho.shape[0]
    nc = P.nvar.shape[0]
    full = mode == POSE
    aimed = mode == TARGET or full
    step_x = np.zeros_like(x)
    responses = np.zeros((nc, x.shape[1] + 6, 7 + m))
    rates = np.zeros((m, 6))
    S = np.empty((6, 6))
    for passes in range(1, MAX_PASSES + 1):
        lever = _mul(R, tool)
        S[:] = 0.0
        rhs = np.empty(6)
        rhs[:3] = force + wrench[:3]
        rhs[3:] = _cross(lever, force) + wrench[3:]
        turned = cross_matrix(force) @ cross_matrix(lever)  # the moment follows the turning lever
        for i in range(3):
            for j in range(3):
                S[3 + i, 3 + j] -= turned[i, j]
        K_rho = np.zeros((6, m))
        size = 0.0
        for c in range(nc):
            nv = P.nvar[c]
            ok, X, gap, _ = chain_response(P, c, x[c, :nv], rho, F[c], R, p)
            if not ok:
                return SINGULAR, passes
            size = max(size, gap)
            responses[c, : nv + 6, : X.shape[1]] = X
            col = 7
            for i in range(6):
                rhs[i] -= F[c, i] + X[nv + i, 0]
                for j in range(6):
                    S[i, j] += X[nv + i, 1 + j]
            for a in range(m):
                if P.act_chain[a] == c:
                    for i in range(6):
                        K_rho[i, a] = X[nv + i, col]
                    col += 1
        # -- the machine's own unknowns
        dt = np.zeros(6)
        drho = np.zeros(m)
        pull = cross_matrix(lever)  # dp = e + lever x omega keeps the tip on its aim
        if mode == FREE:
            B = rhs.copy().reshape(6, 1)
            M = S.copy()
            if not lu_solve(M, B):
                return SINGULAR, passes
            dt = B[:, 0].copy()
        else:
            e = tip_aim - (p + lever)
            if mode == CLAMP or full:
                w = log_rotation(_mul33(R_aim, R.T))
                dt[:3] = e + _cross(lever, w)
                dt[3:] = w
            if aimed:
                if not rigid_rates(rigid, y, rates):
                    return SINGULAR, passes
                K_cmd = K_rho @ rates
            if full:
                # commanded twist at the tip: dp = d tip + lever_cmd x omega
                shift = cross_matrix(_mul(R_cmd, tool))
                M = K_cmd.copy()
                M[:, 3:] += K_cmd[:, :3].copy() @ shift
                B = (rhs - S @ dt).reshape(6, 1)
                if not lu_solve(M, B):
                    return SINGULAR, passes
                cap = min(1.0, LARGEST_STEP / max(1e-300, np.max(np.abs(B[:3, 0])), LENGTH * np.max(np.abs(B[3:, 0]))))
                B *= cap
                tip_cmd += B[:3, 0]
                R_cmd[:] = _mul33(exp_rotation(B[3:, 0]), R_cmd)
                size = max(size, np.max(np.abs(B[:3, 0])), LENGTH * np.max(np.abs(B[3:, 0])))
            elif mode == TARGET or mode == HOLD:
                M = np.empty((6, 6))
                M[:, :3] = S[:, :3].copy() @ pull + S[:, 3:]
                if mode == TARGET:
                    M[:, 3:] = K_cmd[:, :3]
                else:
                    M[:3, 3:] = -np.eye(3)
                    M[3:, 3:] = -pull
                B = (rhs - S[:, :3].copy() @ e).reshape(6, 1)
                if not lu_solve(M, B):
                    return SINGULAR, passes
                dt[3:] = B[:3, 0]
                dt[:3] = e + pull @ B[:3, 0].copy()
                if mode == TARGET:
                    cap = min(1.0, LARGEST_STEP / max(1e-300, np.max(np.abs(B[3:, 0]))))
                    tip_cmd += cap * B[3:, 0]
                    size = max(size, np.max(np.abs(B[3:, 0])))
                else:
                    force += B[3:, 0]
            if aimed:
                before = rho.copy()
                status, _ = rigid_kinematics(rigid, R_cmd, tip_cmd - _mul(R_cmd, tool), rho, y)
                if status != OK:
                    return status, passes
                drho = rho - before
        size = max(size, np.max(np.abs(dt[:3])), LENGTH * np.max(np.abs(dt[3:])))
        if not np.isfinite(size):
            return MAX_ITERATIONS, passes
        # -- back to the chains
        largest = 0.0
        for c in range(nc):
            nv = P.nvar[c]
            for i in range(nv):
                value = responses[c, i, 0]
                for j in range(6):
                    value += responses[c, i, 1 + j] * dt[j]
                col = 7
                for a in range(m):
                    if P.act_chain[a] == c:
                        value += responses[c, i, col] * drho[a]
                        col += 1
                step_x[c, i] = value
                largest = max(largest, abs(value) * (LENGTH if P.turns[c, i] else 1.0))
        size = max(size, largest)
        cap = min(1.0, LARGEST_STEP / max(size, 1e-300))
        for c in range(nc):
            nv = P.nvar[c]
            for i in range(nv):
                x[c, i] += cap * step_x[c, i]
            for r in range(6):
                value = responses[c, nv + r, 0]
                for j in range(6):
                    value += responses[c, nv + r, 1 + j] * dt[j]
                col = 7
                for a in range(m):
                    if P.act_chain[a] == c:
                        value += responses[c, nv + r, col] * drho[a]
                        col += 1
                F[c, r] += cap * value
        p += cap * dt[:3]
        R[:] = _mul33(exp_rotation(cap * dt[3:]), R)
        if size < STEP_DONE:
            return OK, passes
    return MAX_ITERATIONS, MAX_PASSES


@njit(cache=True, nogil=True, error_model="numpy")
def actuator_forces(P, x, rho, out):
    """Fills out (m,): force the drive exerts on its carriage, positive along the actuator."""
    for c in range(P.nvar.shape[0]):
        for e in range(P.first[c], P.first[c + 1]):
            if P.act[e] >= 0:
                out[P.act[e]] = -P.joint_stiffness[e] * (x[c, P.var[e]] - rho[P.act[e]])


@njit(cache=True, nogil=True, error_model="numpy")
def machine_stiffness(P, x, rho, F, R, p, chains, by_rho, act_by_pose, act_by_rho):
    """Loaded stiffness at a solved point, with all Hessian terms.

    Fills chains (c, 6, 6) = d F_c / d pose, by_rho (6, m) = d sum F / d rho, and the reaction of the drive forces,
    act_by_pose (m, 6), act_by_rho (m, m). Returns False if singular.
    """
    m = rho.shape[0]
    by_rho[:] = 0.0
    act_by_rho[:] = 0.0
    for c in range(P.nvar.shape[0]):
        nv = P.nvar[c]
        ok, X, _, _ = chain_response(P, c, x[c, :nv], rho, F[c], R, p)
        if not ok:
            return False
        for i in range(6):
            for j in range(6):
                chains[c, i, j] = X[nv + i, 1 + j]
        col = 7
        for a in range(m):
            if P.act_chain[a] == c:
                for i in range(6):
                    by_rho[i, a] = X[nv + i, col]
                for b in range(m):
                    if P.act_chain[b] == c:
                        act_by_rho[b, a] = X[P.act_var[b], col] - (1.0 if a == b else 0.0)
                col += 1
        for e in range(P.first[c], P.first[c + 1]):
            a = P.act[e]
            if a >= 0:
                act_by_rho[a] *= -P.joint_stiffness[e]
                for j in range(6):
                    act_by_pose[a, j] = -P.joint_stiffness[e] * X[P.var[e], 1 + j]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def load_stiffness(R, tool, force):
    """(6, 6) derivative of the tip load's wrench by the pose: the moment of a dead load follows the turning lever."""
    out = np.zeros((6, 6))
    out[3:, 3:] = cross_matrix(force) @ cross_matrix(_mul(R, tool))
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def approach(rigid, start_R, start_tip, tool, R_to, tip_to, rho, y):
    """Inverse kinematics of a far pose: walks from the start pose in short steps, so that the branch stays."""
    y[:] = rigid.start
    turn = log_rotation(_mul33(R_to, start_R.T))
    way = tip_to - start_tip
    steps = int(np.ceil(max(np.max(np.abs(way)) / 20.0, np.max(np.abs(turn)) / 0.2, 1.0)))
    status = OK
    for i in range(1, steps + 1):
        R = _mul33(exp_rotation(turn * (i / steps)), start_R)
        status, _ = rigid_kinematics(rigid, R, start_tip + way * (i / steps) - _mul(R, tool), rho, y)
        if status != OK and i == steps:
            return status
    return status


@njit(cache=True, nogil=True, error_model="numpy")
def solve_many(
    mode, P, rigid, joint_var, tool, start_R, start_tip, R_near, R_aim, near, aim, force, wrench, rho, follow, check,
    rho_nominal, tip_cmd, R_cmd, tip, R, drive, status, passes, x_all, F_all,
):  # fmt: skip
    """Points one after the other, each started from the one before; falls back to a cold start, then to load steps.

    Shapes: R_aim, R, R_cmd (n, 3, 3); near, aim, force, tip, tip_cmd (n, 3); wrench (n, 6); rho, rho_nominal, drive
    (n, m); x_all (n or 0, c, nv), F_all (n or 0, c, 6) keep the states when asked for.
    """
    n, m = rho.shape
    nc = P.nvar.shape[0]
    y = rigid.start.copy()
    x = np.zeros((nc, P.start.shape[1]))
    F = np.zeros((nc, 6))
    warm = False
    p = np.zeros(3)
    for i in range(n):
        status[i] = OK
        y_before = y.copy()
        code = OUT_OF_REACH
        if warm and np.max(np.abs(near[i] - near[i - 1])) < 20.0:
            code, _ = rigid_kinematics(rigid, R_near[i], near[i] - _mul(R_near[i], tool), rho_nominal[i], y)
        if code != OK:
            warm = False
            code = approach(rigid, start_R, start_tip, tool, R_near[i], near[i], rho_nominal[i], y)
        if code != OK:
            status[i] = code
            y[:] = y_before
            continue
        if follow:  # the control is told to go to `near`
            rho[i] = rho_nominal[i]
        for attempt in range(3):
            if attempt == 0 and not warm:
                continue
            if mode == TARGET or mode == POSE:
                rho[i] = rho_nominal[i]
                if attempt == 0:
                    tip_cmd[i] = near[i] + (tip_cmd[i - 1] - near[i - 1])
                    R_cmd[i] = R_cmd[i - 1] if mode == POSE else R_aim[i]
                else:
                    tip_cmd[i] = near[i]
                    R_cmd[i] = R_near[i]
            y_now = y.copy()
            if (mode == TARGET or mode == POSE) and attempt == 0:
                rigid_kinematics(rigid, R_cmd[i], tip_cmd[i] - _mul(R_cmd[i], tool), rho[i], y_now)
            steps = 8 if attempt == 2 else 1
            if attempt > 0:
                to_structure(joint_var, y, rho[i], x, F, P)
                R[i] = R_near[i]
            else:
                R[i] = R[i - 1]
            p = near[i] - _mul(R[i], tool)
            f = force[i].copy()
            for k in range(1, steps + 1):
                f = force[i] * (k / steps)
                code, count = solve_point(
                    mode, P, rigid, tool, R_aim[i], aim[i], f, wrench[i] * (k / steps), rho[i], y_now, x, F, R[i], p,
                    tip_cmd[i], R_cmd[i],
                )  # fmt: skip
                if code != OK:
                    break
            passes[i] = count
            if code == OK:
                break
        status[i] = code
        if code == OK:
            if mode == HOLD:
                force[i] = f
            tip[i] = p + _mul(R[i], tool)
            actuator_forces(P, x, rho[i], drive[i])
            if check and not chains_stable(P, x, rho[i], F, R[i], p):
                status[i] = UNSTABLE
            if check and status[i] == OK and mode != HOLD and mode != CLAMP:
                chains = np.zeros((nc, 6, 6))
                S = -load_stiffness(R[i], tool, f)
                if not machine_stiffness(
                    P, x, rho[i], F, R[i], p, chains, np.zeros((6, m)), np.zeros((m, 6)), np.zeros((m, m))
                ):
                    status[i] = SINGULAR
                for c in range(nc):
                    S += chains[c]
                if status[i] == OK and not positive_definite(S):
                    status[i] = UNSTABLE
            if x_all.shape[0] > 0:
                x_all[i] = x
                F_all[i] = F
        warm = code == OK
