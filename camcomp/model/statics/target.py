"""The modified target: commanded tip for which the loaded tip is at the programmed position.

Klimchik, Pashkevich, Chablat, Hovland, "Compensation of compliance errors in parallel manipulators composed of
non-perfect kinematic chains" (2012), eqs. (2)-(5). A machine with three actuators corrects the tip position; the
platform's tilt stays and is reported.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.records import Rows, dataclass, replace
from camcomp.model.statics.arm import NEAR_SINGULAR, arm_of, dexterity
from camcomp.model.statics.machine import Machine
from camcomp.model.statics.rigid import MAX_ITERATIONS, SINGULAR
from camcomp.model.statics.solve import FREE, HOLD, POSE, TARGET, State, inverse, solve

Array = NDArray[np.float64]
METHODS = ("newton", "stiffness", "fixed-point", "linear")
TIP_DONE = 1e-7  # mm, iteration of eqs. (4) and (5) ends here
MAX_TARGET_STEPS = 60


@dataclass(frozen=True, kw_only=True)
class Correction(Rows):
    """Solved targets. Rows with status != 0 hold NaN.

    commanded (n, 3) tip to be commanded, mm; rho_nominal, rho (n, m) actuator coordinates of the requested and of the
    commanded point; drive (n, m) drive forces under load; tilt (n, 3) rad, of the loaded platform against the requested
    orientation; status, iterations (n,); rotation (n, 3, 3) of the platform to be commanded.
    """

    commanded: Array
    rho_nominal: Array
    rho: Array
    drive: Array
    tilt: Array
    status: NDArray[np.int64]
    iterations: NDArray[np.int64]
    rotation: Array

    @staticmethod
    def of(state: State, iterations: NDArray[np.int64]) -> Correction:
        """The correction in a solver state."""
        return Correction(
            commanded=state.commanded,
            rho_nominal=state.rho_nominal,
            rho=state.rho,
            drive=state.drive,
            tilt=state.tilt,
            status=state.status,
            iterations=iterations,
            rotation=state.commanded_rotation,
        )


def correct(
    machine: Machine,
    aim: Array,
    force: Array,
    wrench: Array | None = None,
    method: str = "newton",
    *,
    pose: bool = False,
    rotation: Array | None = None,
    tips_only: bool = False,
) -> Correction:
    """Commanded tips t0F with F = f(t0 | t0F) at every point.

    aim (n, 3) mm programmed tips, force (n, 3) N at the tip, wrench (n, 6) at the platform reference; machine frame.
    method: newton = eq. (3), stiffness = eq. (4), fixed-point = eq. (5), linear = one step with the unloaded Cartesian
    compliance (baseline, no iteration). pose (newton, machines with six actuators): the orientation is corrected too, not
    only the tip. rotation (n, 3, 3): requested orientation of the platform, and without pose the commanded one; None: the
    one that the machine holds. tips_only: only `commanded` and `status` of the result are used. Raises ValueError for an
    unknown method.
    """
    if method == "newton":
        mode = POSE if pose else TARGET
        state = solve(machine, mode, aim, aim_rotation=rotation, force=force, wrench=wrench, tips_only=tips_only)
        return Correction.of(replace(state, status=_why(machine, state)), state.passes)
    if rotation is not None:
        raise ValueError("only the method newton knows orientations")
    if method in ("stiffness", "fixed-point"):
        return _iterate(machine, aim, force, wrench, method)
    if method == "linear":
        commanded = aim - np.einsum("nij,nj->ni", tip_compliance(machine, aim), force)
        return settle(machine, commanded, force, wrench, aim)[1]
    raise ValueError(f"method '{method}' is none of {', '.join(METHODS)}")


def _why(machine: Machine, state: State) -> NDArray[np.int64]:
    """Status (n,); SINGULAR for an arm that did not converge near a singular configuration."""
    stuck = np.flatnonzero(state.status == MAX_ITERATIONS)
    arm = arm_of(machine.nominal) if len(stuck) else None
    if arm is None:
        return state.status
    status = state.status.copy()
    status[stuck[dexterity(arm, state.rho_nominal[stuck]) < NEAR_SINGULAR]] = SINGULAR
    return status


def settle(
    machine: Machine, commanded: Array, force: Array, wrench: Array | None = None, aim: Array | None = None, *,
    rotation: Array | None = None, tips_only: bool = False,
) -> tuple[Array, Correction]:  # fmt: skip
    """Loaded tips (n, 3) of commanded tips, tF = f^-1(F | t0) (eq. 1), and the states as corrections of `aim`.

    rotation (n, 3, 3): commanded orientation of the platform; None: the one that the machine holds. tips_only: drive and
    tilt are not used.
    """
    state = solve(machine, FREE, commanded, aim_rotation=rotation, force=force, wrench=wrench, tips_only=tips_only)
    rho_nominal = state.rho_nominal
    if aim is not None:
        rho_nominal = inverse(machine, aim, rotation)
    state = replace(state, rho_nominal=rho_nominal, commanded=np.where(state.status[:, None] == 0, commanded, np.nan))
    return state.tip, Correction.of(state, state.passes)


def tip_compliance(machine: Machine, tips: Array) -> Array:
    """Tip compliance (n, 3, 3) mm/N of the unloaded machine, by the unit responses of the linearised model."""
    small = 1e-3  # N, for which the response is linear within the round-off of the solver
    columns = []
    for axis in np.eye(3):
        plus = solve(machine, FREE, tips, force=small * axis, check=False).tip
        minus = solve(machine, FREE, tips, force=-small * axis, check=False).tip
        columns.append((plus - minus) / (2.0 * small))
    return np.stack(columns, axis=2)


def _iterate(machine: Machine, aim: Array, force: Array, wrench: Array | None, method: str) -> Correction:
    """Iterate eqs. (4) and (5): the target moves by -alpha times the residual error; alpha halves if the error grows."""
    n = len(aim)
    force = np.broadcast_to(force, (n, 3))
    w = np.zeros((n, 6)) if wrench is None else np.broadcast_to(wrench, (n, 6))
    commanded = aim.copy()
    alpha = np.ones(n)
    best = np.full(n, np.inf)
    step = np.zeros((n, 3))
    iterations = np.zeros(n, np.int64)
    status = np.full(n, 2, np.int64)
    active = np.arange(n)
    C = tip_compliance(machine, aim) if method == "stiffness" else None
    for _ in range(MAX_TARGET_STEPS):
        if method == "fixed-point":
            state = solve(machine, FREE, commanded[active], force=force[active], wrench=w[active])
            move = aim[active] - state.tip
        else:
            state = solve(machine, HOLD, commanded[active], aim=aim[active], wrench=w[active])
            assert C is not None
            move = -np.einsum("nij,nj->ni", C[active], force[active] - state.force)
        iterations[active] += 1
        error = np.linalg.norm(move, axis=1)
        failed = state.status != 0
        worse = failed | (error > best[active])
        back = active[worse]  # take back half of the last step
        alpha[back] *= 0.5
        step[back] *= 0.5
        commanded[back] -= step[back]
        good = active[~worse]
        best[good] = error[~worse]
        done = ~worse & (error < TIP_DONE)
        status[active[done]] = 0
        step[good] = alpha[good, None] * move[~worse]
        commanded[good] += np.where(done[~worse, None], 0.0, step[good])
        hopeless = failed & (iterations[active] == 1) | (alpha[active] < 1e-4)
        status[active[hopeless]] = np.where(failed[hopeless], state.status[hopeless], 2)
        active = active[~done & ~hopeless]
        if not len(active):
            break
    _, result = settle(machine, commanded, force, w, aim)
    bad = (status != 0) | (result.status != 0)
    merged = np.where(status != 0, status, result.status)
    blank = {
        name: np.where(bad[:, None], np.nan, getattr(result, name)) for name in ("commanded", "rho", "drive", "tilt")
    }
    return replace(result, **blank, status=merged, iterations=iterations)
