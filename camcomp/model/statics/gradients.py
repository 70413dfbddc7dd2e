"""Derivatives at solved points, compiled: loaded stiffness of chains and machine, responses of tip and drive forces."""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

from camcomp.ground.compiled import entry
from camcomp.model.statics.chain import advance, evaluate
from camcomp.model.statics.kernel import walk
from camcomp.model.statics.layout import A_CHAIN, A_ELEMENT, A_VAR, ACT_FIRST, ACTS, SIZE, SPRINGS, STIFFNESS
from camcomp.model.statics.point import evaluate_machine
from camcomp.model.statics.rigid import lu_solve
from camcomp.model.statics.vectors import cross, part, turned, unit


@entry
def gradients_many(P, tool, z, rho, pose, force, solved, chains, total, by_rho, tip_by, drive_by, held, W):
    """Fill the derivatives at every solved point for given actuators (mode FREE).

    Shapes: z (n, c, nz), rho (n, m), pose (n, 12), force (n, 3), solved (n,) int. Fills chains (n, c, 6, 6) = d(chain
    wrench)/d(pose), total (n, 6, 6) = their sum minus the change of the tip load's moment, by_rho (n, 6, m) = d(sum of
    the wrenches)/d(rho), tip_by (n, 3, m + 9) and drive_by (n, m, m + 9) = derivatives of tip and drive forces by rho,
    by the force at the tip, by the wrench at the platform reference. Rows of singular points are left as they are.
    held (m, nz): room to work in.
    """
    m = rho.shape[1]
    M = W.solve
    S = W.machine
    for i in range(rho.shape[0]):
        if solved[i] == 0:
            continue
        for a in range(m):  # stiffness of the carriage without its drive, before the elimination overwrites it
            c = P.actuator[a, A_CHAIN]
            v = P.actuator[a, A_VAR]
            evaluate(P, c, z[i, c], rho[i], pose[i], W, True)
            for r in range(P.chain[c, SIZE]):
                held[a, r] = W.matrix[c, v, r]
            held[a, v] -= P.value[P.actuator[a, A_ELEMENT], STIFFNESS]
        evaluate_machine(P, tool, force[i], pose[i], z[i], rho[i], W, True)
        lever = turned(pose[i], part(tool, 0))
        for r in range(6):
            for k in range(6):
                M[r, k] = S[r, k]
            for a in range(m):
                M[r, 6 + a] = -S[r, 6 + a]
            for k in range(3):  # (e_k; lever x e_k)
                moment = cross(lever, unit(k))
                M[r, 6 + m + k] = (1.0 if r == k else 0.0) if r < 3 else moment[r - 3]
            for k in range(6):
                M[r, 9 + m + k] = 1.0 if r == k else 0.0
        if not lu_solve(M, 6, m + 9):
            continue
        for r in range(6):
            for k in range(6):
                total[i, r, k] = S[r, k]
                for c in range(P.chain.shape[0]):
                    chains[i, c, r, k] = W.answer[c, r, 1 + k]
            for a in range(m):
                by_rho[i, r, a] = S[r, 6 + a]
        for c in range(P.chain.shape[0]):  # the residual of a solved point is zero
            for r in range(P.chain[c, SIZE]):
                W.matrix[c, r, P.chain[c, SIZE]] = 0.0
                W.answer[c, r, 0] = 0.0
        for k in range(m + 9):
            for r in range(6):
                W.step[r] = M[r, 6 + k]
            for a in range(m):
                W.step[6 + a] = 1.0 if a == k else 0.0
            swing = cross(part(W.step, 3), lever)
            for r in range(3):
                tip_by[i, r, k] = W.step[r] + swing[r]
            for c in range(P.chain.shape[0]):
                f0 = P.chain[c, SPRINGS]
                n = P.chain[c, SIZE]
                advance(W.matrix[c], W.answer[c], f0, n, P.chain[c, ACT_FIRST], P.chain[c, ACTS], W.step, W.dz[c])
            for a in range(m):
                c = P.actuator[a, A_CHAIN]
                change = 0.0
                for r in range(P.chain[c, SIZE]):
                    change += held[a, r] * W.dz[c, r]
                drive_by[i, a, k] = change


@entry
def ends_many(P, z, ends, W):
    """Fills ends (n, c, 12): pose of every chain's end at the chain states z (n, c, nz)."""
    for i in range(z.shape[0]):
        for c in range(P.chain.shape[0]):
            walk(P, c, z[i, c], W)
            for k in range(12):
                ends[i, c, k] = W.end[k]
