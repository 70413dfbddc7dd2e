"""Solution of the machine for arrays of points: inverse kinematics, loaded pose, holding force.

Arrays over points, machine frame, mm, N, rad. Long arrays are solved in pieces of fixed size on all cores; the pieces
start cold, so results do not depend on the number of cores.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.progress import points
from camcomp.ground.records import dataclass, fields, replace
from camcomp.model.statics import point, rigid, sweep
from camcomp.model.statics.layout import SPRINGS, new_memory, new_work
from camcomp.model.statics.machine import Machine
from camcomp.model.statics.rotation import rotation_vectors

if TYPE_CHECKING:
    from concurrent.futures import Executor

Array = NDArray[np.float64]
PIECE = 256
FREE, HOLD, TARGET, CLAMP, POSE, INVERSE = point.FREE, point.HOLD, point.TARGET, point.CLAMP, point.POSE, point.INVERSE
STATUS = {
    rigid.OK: "solved",
    rigid.MAX_ITERATIONS: "no convergence",
    rigid.OUT_OF_REACH: "out of reach",
    rigid.SINGULAR: "singular configuration",
    rigid.UNSTABLE: "not stable (buckling)",
}


@dataclass(frozen=True, kw_only=True)
class State:
    """Solved points. Rows whose status is not 0 hold NaN.

    tip (n, 3) loaded tool tip; rotation (n, 3, 3) platform; tilt (n, 3) its rotation vector against the nominal
    orientation, rad; commanded (n, 3) tip; rho (n, m) its actuator coordinates; rho_nominal (n, m) inverse kinematics of
    the requested point; drive (n, m) force of each drive on its carriage; force (n, 3) at the tip; status, passes (n,) int;
    x (n, c, nz), F (n, c, 6): internal states and wrenches of the chains, empty without keep; commanded_rotation (n, 3, 3);
    wrench (n, 6): sum of the chains' wrenches, the whole load at the platform reference (the result of CLAMP, and of HOLD
    with six actuators). INVERSE sets rho_nominal only.
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
    commanded_rotation: Array
    wrench: Array

    def with_rows(self, rows: NDArray[np.int64], own: State) -> State:
        """The same states with others at some rows."""
        changed: dict[str, Any] = {}
        for each in fields(State):
            value = getattr(self, each.name)
            if len(value) == len(self.status):
                changed[each.name] = with_rows(value, rows, getattr(own, each.name))
        return replace(self, **changed)


def with_rows(values: Array, rows: NDArray[np.int64], own: Array) -> Array:
    """A copy of values (n, ...) with others at some rows."""
    out = np.array(values)
    out[rows] = own
    return out


def _per_point(value: Array | None, n: int, shape: tuple[int, ...]) -> Array:
    if value is None:
        return np.zeros((n, *shape))
    return np.ascontiguousarray(np.broadcast_to(np.asarray(value, float), (n, *shape))).copy()


def _start(machine: Machine, rotation: Array, reference: Array) -> tuple[Array, Array]:
    """Initial pose and joint coordinates of the numeric inverse kinematics: the first point, if in closed form."""
    if machine.closed_form is not None and (q := machine.closed_form.near(rotation, reference)) is not None:
        return np.concatenate((rotation.ravel(), reference)), q[None]
    return machine.start_pose, machine.start_y


def threads() -> int:
    """Number of threads of the solver: CAMCOMP_THREADS, default the cores of this process."""
    limit = os.environ.get("CAMCOMP_THREADS", "")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, int(limit)) if limit.isdigit() else cores


def in_pieces(work: Callable[[slice], None], n: int, most: int = PIECE) -> None:
    """Run work on slices of at most `most` of n points on all cores, with progress messages."""
    pieces = [slice(a, min(a + most, n)) for a in range(0, n, most)]
    workers = min(threads(), len(pieces))
    if workers < 2:
        for piece in points(pieces, len(pieces)):
            work(piece)
        return
    list(points(_pool(threads()).map(work, pieces), len(pieces)))


@cache
def _pool(workers: int) -> Executor:
    """Threads that stay until the process ends: loops with memory ask thousands of times for a few thousand points."""
    from concurrent.futures import ThreadPoolExecutor  # slow import, for several threads only

    return ThreadPoolExecutor(workers)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)  # threads stay with the parent


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
    tips_only: bool = False,
) -> State:
    """Solves every point in one of the modes of camcomp.statics.point.

    near (n, 3): a tip position near the answer (its nominal joint coordinates start the solver). force (n, 3) at the
    tip, wrench (n, 6) at the platform reference. rho (n, m) commanded in FREE, HOLD and CLAMP; default: the set-points of
    `near`. check: verify stability. tips_only: drive and tilt of the result are not used,
    in TARGET nothing but its commanded tips and its status.
    """
    n, m = len(near), len(machine.actuators)
    able = aim is None and aim_rotation is None and check and not keep and (wrench is None or not np.any(wrench))
    if machine.answers is not None and mode in (FREE, TARGET) and able:
        return machine.answers.solve(mode, near, _per_point(force, n, (3,)), rho, tips_only=tips_only)  # type: ignore[no-any-return]
    tool = np.ascontiguousarray(machine.robot.tool, float)
    aim = np.ascontiguousarray(near if aim is None else aim, float)
    near, R_near, R_aim = _starts_and_aims(machine, mode, near, aim_rotation)
    f, w = _per_point(force, n, (3,)), _per_point(wrench, n, (6,))
    r = np.zeros((n, m)) if rho is None else np.array(rho, float).reshape(n, m)
    nominal, drive, tip, total = (np.full((n, k), np.nan) for k in (m, m, 3, 6))
    goal, pose = np.full((n, 12), np.nan), np.full((n, 12), np.nan)
    status, passes = np.zeros(n, np.int64), np.zeros(n, np.int64)
    kept = np.zeros((n if keep else 0, *machine.elastic.scale.shape))

    def work(s: slice) -> None:
        start, start_y = _start(machine, R_near[s.start], near[s.start] - R_near[s.start] @ tool)
        sweep.solve_many(
            mode, machine.elastic, machine.rigid, machine.joint_var, tool, start, start_y,
            rho is None, check, R_near[s].reshape(-1, 9),
            R_aim[s].reshape(-1, 9), near[s], aim[s], f[s], w[s], r[s], nominal[s], goal[s], pose[s],
            tip[s], drive[s], total[s], status[s], passes[s], kept[s] if keep else kept,
            new_memory(machine.elastic, machine.rigid), new_work(machine.elastic, machine.rigid),
        )  # fmt: skip

    in_pieces(work, n)
    bad = status != rigid.OK
    for a in (tip, drive, total, goal, pose, r):
        a[bad] = np.nan
    if mode == HOLD:
        f[bad] = np.nan
    nominal[status == rigid.OUT_OF_REACH] = np.nan
    R, R_cmd = pose[:, :9].reshape(n, 3, 3), goal[:, :9].reshape(n, 3, 3)
    tilt, commanded = rotation_vectors(R @ R_aim.transpose(0, 2, 1)), goal[:, 9:] + R_cmd @ machine.nominal.tool
    f0 = machine.elastic.chain[:, SPRINGS]
    F = np.stack([kept[:, c, k : k + 6] for c, k in enumerate(f0)], axis=1)
    return State(
        tip=tip, rotation=R, tilt=tilt, commanded=commanded, rho=r, rho_nominal=nominal, drive=drive, force=f,
        status=status, passes=passes, x=kept, F=F, commanded_rotation=R_cmd, wrench=total,
    )  # fmt: skip


def _starts_and_aims(
    machine: Machine, mode: int, near: Array, aim_rotation: Array | None
) -> tuple[Array, Array, Array]:
    """Tips (n, 3) and orientations (n, 3, 3) that start the solver, and the orientations (n, 3, 3) aimed at.

    The controller aims with its own tool length; the kernels have one tool, the true one.
    """
    held = machine.nominal.held_rotation
    R_aim = _per_point(held if aim_rotation is None else aim_rotation, len(near), (3, 3))
    # a clamped pose may be out of reach of the rigid machine
    R_near = _per_point(held, len(near), (3, 3)) if mode == CLAMP else R_aim
    longer = np.ascontiguousarray(machine.robot.tool, float) - machine.nominal.tool
    return np.ascontiguousarray(near, float) + R_near @ longer, R_near, R_aim


def inverse(machine: Machine, tip: Array, rotation: Array | None = None) -> Array:
    """Actuator coordinates (n, m) that the controller computes for tips (n, 3); NaN out of reach.

    rotation (n, 3, 3): commanded orientation of the platform; None: the one that the machine holds.
    """
    return solve(machine, INVERSE, tip, aim_rotation=rotation, check=False).rho_nominal
