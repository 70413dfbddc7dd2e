"""The machine's answers for arrays of points: inverse kinematics, loaded pose, holding force, stiffness.

Arrays over points, machine frame, mm, N, rad. Long arrays are solved in pieces of fixed size on all cores; the pieces
start cold, so results do not depend on the number of cores.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from camcomp.statics import point
from camcomp.statics.machine import Machine

Array = NDArray[np.float64]
PIECE = 256
FREE, HOLD, TARGET, CLAMP, POSE = point.FREE, point.HOLD, point.TARGET, point.CLAMP, point.POSE
STATUS = {
    point.OK: "solved",
    point.MAX_ITERATIONS: "no convergence",
    point.OUT_OF_REACH: "out of reach",
    point.SINGULAR: "singular configuration",
    point.UNSTABLE: "not stable (buckling)",
}


@dataclass(frozen=True)
class State:
    """Solved points. Rows whose status is not 0 hold NaN.

    tip (n, 3) loaded tool tip; rotation (n, 3, 3) platform; tilt (n, 3) its rotation vector against the nominal
    orientation, rad; commanded (n, 3) tip the control is told; rho (n, m) actuator coordinates that go with it;
    rho_nominal (n, m) inverse kinematics of the point asked for; drive (n, m) force of each drive on its carriage;
    force (n, 3) at the tip; status, passes (n,) int; x, F: internal states, empty unless asked for.
    """

    tip: Array
    rotation: Array
    tilt: Array
    commanded: Array
    rho: Array
    rho_nominal: Array
    drive: Array
    force: Array
    status: NDArray[np.int64]
    passes: NDArray[np.int64]
    x: Array
    F: Array


def _per_point(value: Array | None, n: int, shape: tuple[int, ...]) -> Array:
    if value is None:
        return np.zeros((n, *shape))
    return np.ascontiguousarray(np.broadcast_to(np.asarray(value, float), (n, *shape))).copy()


def threads() -> int:
    """Threads of the solver: as many as there are cores for this process, or what CAMCOMP_THREADS says."""
    limit = os.environ.get("CAMCOMP_THREADS", "")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, int(limit)) if limit.isdigit() else cores


def _in_pieces(work: Callable[[slice], None], n: int) -> None:
    """Runs work on slices of PIECE points, on every core."""
    pieces = [slice(a, min(a + PIECE, n)) for a in range(0, n, PIECE)]
    if len(pieces) == 1:
        work(pieces[0])
        return
    with ThreadPoolExecutor(threads()) as pool:
        list(pool.map(work, pieces))


def solve(
    machine: Machine,
    mode: int,
    near: Array,
    *,
    aim: Array | None = None,
    aim_rotation: Array | None = None,
    force: Array | None = None,
    wrench: Array | None = None,
    rho: Array | None = None,
    check: bool = True,
    keep: bool = False,
) -> State:
    """Solves every point in one of the modes of camcomp.statics.point.

    near (n, 3): a tip position near the answer (its nominal joint coordinates start the solver). force (n, 3) at the
    tip, wrench (n, 6) at the platform reference. rho (n, m) commanded in FREE, HOLD and CLAMP; without it the control is
    told to go to `near`. check: prove stability.
    """
    near = np.ascontiguousarray(near, float)
    n, m = len(near), len(machine.actuators)
    nc, nv = machine.elastic.start.shape
    start_R = machine.nominal.start_rotation
    tool = np.ascontiguousarray(machine.robot.tool, float)
    start_tip = machine.nominal.start_reference + start_R @ tool
    aim = near if aim is None else np.ascontiguousarray(aim, float)
    R_aim = _per_point(machine.nominal.held_rotation if aim_rotation is None else aim_rotation, n, (3, 3))
    # the control aims with the tool it knows; the kernels have one tool, the real one
    longer = tool - machine.nominal.tool
    near = near + R_aim @ longer
    # a clamped pose need not be one that the rigid machine can take
    R_near = _per_point(machine.nominal.held_rotation, n, (3, 3)) if mode == CLAMP else R_aim
    f = _per_point(force, n, (3,))
    w = _per_point(wrench, n, (6,))
    r = np.zeros((n, m)) if rho is None else np.array(rho, float).reshape(n, m)
    nominal, drive = np.zeros((n, m)), np.full((n, m), np.nan)
    commanded, tip = near.copy(), np.full((n, 3), np.nan)
    R_cmd, R = R_aim.copy(), R_aim.copy()
    status, passes = np.zeros(n, np.int64), np.zeros(n, np.int64)
    kept = n if keep else 0
    x, F = np.zeros((kept, nc, nv)), np.zeros((kept, nc, 6))

    def work(s: slice) -> None:
        k = s if keep else slice(0, 0)
        point.solve_many(
            mode, machine.elastic, machine.rigid, machine.joint_var, tool, start_R, start_tip, R_near[s], R_aim[s], near[s],
            aim[s], f[s], w[s], r[s], rho is None, check, nominal[s], commanded[s], R_cmd[s], tip[s], R[s], drive[s], status[s],
            passes[s], x[k], F[k],
        )  # fmt: skip

    _in_pieces(work, n)
    commanded = commanded - R_cmd @ longer
    bad = status != point.OK
    for a in (tip, drive, commanded, r):
        a[bad] = np.nan
    return State(tip, R, rotation_vectors(R @ R_aim.transpose(0, 2, 1)), commanded, r, nominal, drive, f, status,
                 passes, x, F)  # fmt: skip


def rotation_vectors(R: Array) -> Array:
    """Rotation vectors (n, 3) rad of small rotations R (n, 3, 3)."""
    w = 0.5 * np.stack((R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]), axis=1)
    s = np.linalg.norm(w, axis=1)
    angle = np.arctan2(s, 0.5 * (np.trace(R, axis1=1, axis2=2) - 1.0))
    return w * np.where(s > 1e-12, angle / np.maximum(s, 1e-300), 1.0)[:, None]
