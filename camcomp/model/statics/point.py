"""The whole machine at one point, compiled: equilibrium of all chains and their common platform in six modes.

One pass linearises every chain (chain.evaluate), eliminates the chains' own coordinates, and solves a 6 x 6 system for
the machine; while steps are short the factored matrices serve several passes. The unknowns depend on the mode:

    FREE     rho given, force given       -> pose                     tF = f^-1(F | t0), seed eq. (1)
    HOLD     rho given, tip given         -> tilt, holding force      F = f(t | t0), seed eq. (1)
    TARGET   tip given, force given       -> tilt, commanded tip      F = f(t0 | t0F), seed eqs. (2)-(3)
    CLAMP    rho given, pose given        -> wrench (6,)              f(t | t0) with the full pose held
    POSE     pose given, force given      -> commanded pose           TARGET without tilt; needs six actuators
    INVERSE  tip given                    -> rho                      rigid: kinematics of the controller
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

import math

from camcomp.ground.compiled import inner
from camcomp.model.statics.chain import add_loads, advance, answer, carry, evaluate, factor
from camcomp.model.statics.layout import (
    A_CHAIN,
    A_VAR,
    ACT_FIRST,
    ACTS,
    MACHINE_LENGTH,
    SIZE,
    SPRINGS,
)
from camcomp.model.statics.rigid import (
    LARGEST_RIGID_STEP,
    MAX_ITERATIONS,
    MAX_PASSES,
    OK,
    SINGULAR,
    UNSTABLE,
    kinematics,
    lu_solve,
)
from camcomp.model.statics.vectors import add_to, cross, dot, log_product, move, part, plus, turned

FREE, HOLD, TARGET, CLAMP, POSE, INVERSE = 0, 1, 2, 3, 4, 5
STEP_DONE = 1e-6  # mm: after a Newton step this short the next one is below 1e-12
ERROR_DONE = 3e-11  # mm: estimated error left by the passes that reuse a factored matrix
SHORT_STEP = 0.1  # mm: below it a factored matrix serves the next pass
CLEARLY_STABLE = 0.02  # smallest relative pivot that needs no second look at the solved point itself


@inner
def evaluate_machine(P, tool, force, pose, z, rho, W, full):
    """Newton step of every chain (W.answer); if full with a new linearisation, else with the factored one.

    full also fills W.margin and W.machine = [S | K_rho]: S (6, 6) = sum of the loaded chain stiffnesses minus that of the
    dead tip load, whose moment follows the turning lever; K_rho (6, m) = sum of the wrenches by actuator coordinate.
    Returns the largest gap, mm.
    """
    S = W.machine
    if full:
        lever = turned(pose, part(tool, 0))
        along = dot(part(force, 0), lever)
        for i in range(6):
            for j in range(S.shape[1]):
                S[i, j] = 0.0
                if i >= 3 and j >= 3 and j < 6:  # [force][lever]
                    S[i, j] -= lever[i - 3] * force[j - 3] - (along if i == j else 0.0)
    gap = 0.0
    for c in range(P.chain.shape[0]):
        n = P.chain[c, SIZE]
        f0 = P.chain[c, SPRINGS]
        acts = P.chain[c, ACTS]
        M = W.matrix[c]
        X = W.answer[c]
        gap = max(gap, evaluate(P, c, z[c], rho, pose, W, full))
        if full:
            W.margin[c] = factor(M, f0, n, acts)
            for i in range(6):
                W.wrench[c, i] = z[c, f0 + i]
        else:
            carry(M, W.residual, n)
        answer(M, X, f0, n, 0, 7 + acts if full else 1)
        if full:
            for i in range(6):
                for j in range(6):
                    S[i, j] += X[i, 1 + j]
                for a in range(acts):
                    S[i, 6 + P.chain[c, ACT_FIRST] + a] = X[i, 7 + a]
    return gap


@inner
def machine_step(mode, P, tool, aim, tip_aim, force, wrench, pose, z, W):
    """Solves for the machine's unknowns: W.step[:6] = platform twist, W.order = twist of the command.

    aim (9,): orientation asked for, tip_aim (3,); force is moved in HOLD. Returns False if singular.
    """
    m = P.actuator.shape[0]
    S = W.machine
    M = W.solve
    lever = turned(pose, part(tool, 0))
    moment = plus(part(wrench, 3), cross(lever, part(force, 0)), 1.0)
    held = mode == CLAMP or mode == POSE  # the full pose
    w = (0.0, 0.0, 0.0)
    way = (0.0, 0.0, 0.0)
    if held:
        w = log_product(aim, pose)
    if mode != FREE:
        way = plus(plus(part(tip_aim, 0), part(pose, 9), -1.0), lever, -1.0)
    for k in range(6):
        W.step[k] = 0.0
        W.order[k] = 0.0
    add_to(W.step, 0, plus(way, cross(lever, w), 1.0))
    add_to(W.step, 3, w)
    for i in range(6):
        # load minus wrenches after the chains' own steps and the known part of the platform's motion
        M[i, 6] = force[i] + wrench[i] if i < 3 else moment[i - 3]
        for c in range(P.chain.shape[0]):
            M[i, 6] -= z[c, P.chain[c, SPRINGS] + i] + W.answer[c, i, 0]
        for j in range(6):
            M[i, 6] -= S[i, j] * W.step[j]
            M[i, j] = S[i, j]
            if mode == TARGET or mode == POSE:
                M[i, j] = 0.0
                for a in range(m):
                    M[i, j] += S[i, 6 + a] * W.rates[a, j]
        if mode == TARGET or mode == HOLD:  # turns w with dp = way + lever x w, and the command or the force
            for j in range(3):
                k = (j + 1) % 3
                n = (j + 2) % 3
                M[i, 3 + j] = M[i, j]
                M[i, j] = S[i, 3 + j] + lever[n] * S[i, k] - lever[k] * S[i, n]
                if mode == HOLD:
                    M[i, 3 + j] = -1.0 if i == j else 0.0
                    if i == 3 + k:
                        M[i, 3 + j] = -lever[n]
                    if i == 3 + n:
                        M[i, 3 + j] = lever[k]
    if mode == CLAMP:
        return True
    if not lu_solve(M, 6, 1):
        return False
    for i in range(6):
        x = M[i, 6]
        if mode == FREE:
            W.step[i] = x
        elif mode == POSE:
            W.order[i] = x
        elif i < 3:
            W.step[3 + i] = x
        elif mode == TARGET:
            W.order[i - 3] = x
        else:
            force[i - 3] += x
    if mode == TARGET or mode == HOLD:
        add_to(W.step, 0, cross(lever, part(W.step, 3)))
    return True


@inner
def solve_point(mode, P, rigid, tool, aim, tip_aim, force, wrench, rho, pose, z, command, y_command, W, check):
    """Newton's method on the whole machine at one point. Start and result: pose (12,), z; force (HOLD); in TARGET and
    POSE rho, the commanded pose (12,) and its joint coordinates y_command, W.rates being their rates.

    aim (9,) orientation and tip_aim (3,) asked for; force (3,) at the tip and wrench (6,) at the platform reference,
    machine axes. Returns (status, passes).
    """
    m = rho.shape[0]
    aimed = mode == TARGET or mode == POSE
    fresh = True
    size = 1e300
    for passes in range(1, MAX_PASSES + 1):
        before = size
        size = evaluate_machine(P, tool, force, pose, z, rho, W, fresh)
        if fresh:
            size = 0.0  # the step decides
        if not machine_step(mode, P, tool, aim, tip_aim, force, wrench, pose, z, W):
            return SINGULAR, passes
        for k in range(6):
            size = max(size, max(abs(W.step[k]), abs(W.order[k])) * (1.0 if k < 3 else MACHINE_LENGTH))
        if not math.isfinite(size):
            return MAX_ITERATIONS, passes
        for a in range(m):
            W.step[6 + a] = -rho[a]
        if aimed:
            move(command, part(W.order, 0), part(W.order, 3), min(1.0, LARGEST_RIGID_STEP / max(size, 1e-300)))
            code = kinematics(rigid, command, y_command, rho, W, 6)
            if code != OK:
                return code, passes
        for a in range(m):
            W.step[6 + a] += rho[a]
            size = max(size, abs(W.step[6 + a]) * P.scale[P.actuator[a, A_CHAIN], P.actuator[a, A_VAR]])
        for c in range(P.chain.shape[0]):
            n = P.chain[c, SIZE]
            f0 = P.chain[c, SPRINGS]
            dz = W.dz[c]
            advance(W.matrix[c], W.answer[c], f0, n, P.chain[c, ACT_FIRST], P.chain[c, ACTS], W.step, dz)
            for i in range(n):
                size = max(size, abs(dz[i]) * P.scale[c, i])
        if not math.isfinite(size):
            return MAX_ITERATIONS, passes
        share = min(1.0, LARGEST_RIGID_STEP / max(size, 1e-300))
        for c in range(P.chain.shape[0]):
            for i in range(P.chain[c, SIZE]):
                z[c, i] += share * W.dz[c, i]
        move(pose, part(W.step, 0), part(W.step, 3), share)
        ratio = size / before
        if (fresh and size < STEP_DONE) or (not fresh and ratio < 0.5 and size * ratio < ERROR_DONE):
            # Stability is read from the last linearisation if it is clear there and the wrenches have hardly changed since.
            margin = 1.0
            change = 0.0
            if check:
                for c in range(P.chain.shape[0]):
                    margin = min(margin, W.margin[c])
                    change = max(change, wrench_change(z[c], P.chain[c, SPRINGS], W.wrench[c]))
                if mode == FREE or aimed:
                    margin = min(margin, smallest_pivot(W.machine, W.solve))
            if margin > CLEARLY_STABLE + 5.0 * change or (fresh and change < 1e-3):
                return OK if margin > 1e-12 else UNSTABLE, passes
            fresh = True
        else:
            fresh = size > SHORT_STEP or not (fresh or ratio < 0.1)
    return MAX_ITERATIONS, MAX_PASSES


@inner
def wrench_change(z, f0, before):
    """Largest change of a chain's wrench against `before` (6,), relative to its size; 1 N counts as little."""
    change = 0.0
    size = 1.0
    for r in range(6):
        scale = 1.0 if r < 3 else 1.0 / MACHINE_LENGTH
        size = max(size, abs(z[f0 + r]) * scale)
        change = max(change, abs(z[f0 + r] - before[r]) * scale)
    return change / size


@inner
def smallest_pivot(S, L):
    """Smallest pivot of the symmetric part of S (6, 6), scaled to unit diagonal: positive = positive definite."""
    least = 1.0
    for j in range(6):
        if not S[j, j] > 0.0:
            return -1.0
        for i in range(j, 6):
            value = 0.5 * (S[i, j] + S[j, i])
            for k in range(j):
                value -= L[i, k] * L[j, k]
            if i == j:
                least = min(least, value / S[j, j])
                if not value > 0.0:
                    return -1.0
                value = math.sqrt(value)
                L[j, j] = value
            else:
                L[i, j] = value / L[j, j]
    return least


@inner
def drive_forces(P, z, W, out):
    """Fills out (m,): force the drive exerts on its carriage, positive along the actuator.

    From the equilibrium of the carriage: the deflection of a nearly rigid drive is too small to be evaluated.
    """
    for c in range(P.chain.shape[0]):
        add_loads(P, c, z[c], W, W.matrix[c], False)
        for a in range(P.chain[c, ACT_FIRST], P.chain[c, ACT_FIRST] + P.chain[c, ACTS]):
            out[a] = -W.residual[P.actuator[a, A_VAR]]
