"""Cartesian stiffness of every chain and of the machine, loaded and unloaded, and first derivatives of the tip.

Loaded: derivative of the wrench by the pose at the solved equilibrium, with all Hessian terms (Pashkevich, Klimchik,
Chablat, Mech. Mach. Theory 46 (2011) 662-679). Unloaded: the same where nothing is strained. Assembly: Klimchik et al.
2012, eqs. (6)-(7).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.records import dataclass
from camcomp.model.statics.gradients import gradients_many
from camcomp.model.statics.layout import new_work
from camcomp.model.statics.machine import Machine, build_machine
from camcomp.model.statics.solve import FREE, State, in_pieces, solve

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stiffness:
    """At n points: chains (n, c, 6, 6), their sum machine (n, 6, 6), N/mm, N, N mm/rad at the platform reference point.

    by_rho (n, 6, m): wrench per actuator displacement with the pose held.
    """

    chains: Array
    machine: Array
    by_rho: Array


@dataclass(frozen=True, kw_only=True)
class TipSensitivity:
    """Derivatives at n loaded points with the actuators given: of the tip (mm) and of the drive forces (N or N mm).

    By the actuator coordinates (n, 3 or m, m), by the force at the tip (n, 3 or m, 3), by a wrench at the platform
    reference (n, 3 or m, 6).
    """

    by_rho: Array
    by_force: Array
    by_wrench: Array
    drive_by_rho: Array
    drive_by_force: Array
    drive_by_wrench: Array


def _gradients(machine: Machine, state: State) -> tuple[Array, Array, Array, Array, Array]:
    """Chains, total, by_rho, tip_by, drive_by of gradients_many; NaN in rows that are not solved or singular."""
    n, m = state.rho.shape
    if len(state.x) != n:
        raise ValueError("the state has to be solved with keep=True")
    c = state.x.shape[1]
    out = tuple(np.full((n, *shape), np.nan) for shape in ((c, 6, 6), (6, 6), (6, m), (3, m + 9), (m, m + 9)))
    tool = np.ascontiguousarray(machine.robot.tool, float)
    pose = np.concatenate((state.rotation.reshape(n, 9), state.tip - state.rotation @ tool), axis=1)
    solved = (state.status == 0).astype(np.int64)

    def work(s: slice) -> None:
        gradients_many(
            machine.elastic, tool, state.x[s], state.rho[s], pose[s], state.force[s], solved[s], *(a[s] for a in out),
            np.zeros((m, state.x.shape[2])), new_work(machine.elastic, machine.rigid),
        )  # fmt: skip

    in_pieces(work, n)
    return out  # type: ignore[return-value]


def loaded_stiffness(machine: Machine, state: State) -> Stiffness:
    """Stiffness at solved points, d(wrench)/d(pose) with the actuators held. `state` has to be solved with keep=True.

    Raises ValueError when the state does not hold its inner variables.
    """
    chains, _, by_rho, _, _ = _gradients(machine, state)
    return Stiffness(chains, chains.sum(axis=1), -by_rho)


def unloaded_stiffness(machine: Machine, tips: Array) -> Stiffness:
    """Stiffness (n, ...) of the perfect machine without any load at tips (n, 3): K_C of the seed's eqs. (4) and (7)."""
    perfect = build_machine(machine.nominal, machine.nominal)
    return loaded_stiffness(perfect, solve(perfect, FREE, tips, check=False, keep=True))


def tip_sensitivity(machine: Machine, state: State) -> TipSensitivity:
    """First derivatives of tip and drive forces at points solved with keep=True, exact at the loaded point."""
    m = state.rho.shape[1]
    tip, drive = _gradients(machine, state)[3:]
    rho, force, wrench = slice(None, m), slice(m, m + 3), slice(m + 3, None)
    return TipSensitivity(
        by_rho=tip[..., rho], by_force=tip[..., force], by_wrench=tip[..., wrench],
        drive_by_rho=drive[..., rho], drive_by_force=drive[..., force], drive_by_wrench=drive[..., wrench],
    )  # fmt: skip


def tip_compliance(machine: Machine, state: State) -> Array:
    """Displacement of the tip (n, 3, 3) mm/N per force at the tip, at solved points."""
    return tip_sensitivity(machine, state).by_force


def assembly_shift(stiffness: Array, shifts: Array) -> tuple[Array, Array]:
    """Platform displacement (n, 6) and internal wrenches (n, c, 6) from chain errors, to first order: eq. (7).

    stiffness (n, c, 6, 6) of the chains, shifts (n, c, 6): dt = (sum K_i)^-1 sum K_i eps_i, F_i = K_i (dt - eps_i).
    """
    total = np.einsum("ncij,ncj->ni", stiffness, shifts)
    dt = np.linalg.solve(stiffness.sum(axis=1), total[..., None])[..., 0]
    return dt, np.einsum("ncij,ncj->nci", stiffness, dt[:, None, :] - shifts)
