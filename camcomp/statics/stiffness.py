"""Cartesian stiffness of every chain and of the machine, loaded and unloaded, and the linear assembly displacement.

Loaded: derivative of the wrench by the pose at the solved equilibrium, with all Hessian terms (Pashkevich, Klimchik,
Chablat, Mech. Mach. Theory 46 (2011) 662-679). Unloaded: the same where nothing is strained. Assembly: Klimchik et al.
2012, eqs. (6)-(7).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from camcomp.statics.kernel import new_slots, walk
from camcomp.statics.machine import Machine, build_machine
from camcomp.statics.point import load_stiffness, machine_stiffness
from camcomp.statics.rotation import log_rotation
from camcomp.statics.solve import FREE, State, solve

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stiffness:
    """At n points: chains (n, c, 6, 6), their sum machine (n, 6, 6), N/mm, N, N mm/rad at the platform reference point.

    by_rho (n, 6, m): wrench per actuator displacement with the pose held.
    """

    chains: Array
    machine: Array
    by_rho: Array


def loaded_stiffness(machine: Machine, state: State) -> Stiffness:
    """Stiffness at solved points, d(wrench)/d(pose) with the actuators held. `state` has to be solved with keep=True.

    Raises ValueError when the state does not hold its inner variables.
    """
    n, m = state.rho.shape
    if len(state.x) != n:
        raise ValueError("the state has to be solved with keep=True")
    c = state.x.shape[1]
    chains, by_rho = np.full((n, c, 6, 6), np.nan), np.full((n, 6, m), np.nan)
    for i in np.flatnonzero(state.status == 0):
        K, K_rho = np.zeros((c, 6, 6)), np.zeros((6, m))
        R = np.ascontiguousarray(state.rotation[i])
        reference = state.tip[i] - R @ machine.robot.tool
        if machine_stiffness(
            machine.elastic, state.x[i], state.rho[i], state.F[i], R, reference, K, K_rho, np.zeros((m, 6)), np.zeros((m, m))
        ):
            chains[i], by_rho[i] = K, -K_rho
    return Stiffness(chains, chains.sum(axis=1), by_rho)


def unloaded_stiffness(machine: Machine, tips: Array) -> Stiffness:
    """Stiffness (n, ...) of the perfect machine without any load at tips (n, 3): K_C of the seed's eqs. (4) and (7)."""
    perfect = build_machine(machine.nominal, machine.nominal)
    return loaded_stiffness(perfect, solve(perfect, FREE, tips, check=False, keep=True))


def tip_compliance(machine: Machine, state: State) -> Array:
    """Displacement of the tip (n, 3, 3) mm/N per force at the tip, at solved points."""
    K = loaded_stiffness(machine, state).machine
    out = np.full((len(K), 3, 3), np.nan)
    tool = np.ascontiguousarray(machine.robot.tool)
    for i in np.flatnonzero(state.status == 0):
        R = np.ascontiguousarray(state.rotation[i])
        lever = R @ tool
        turn = np.cross(np.eye(3), lever)  # rows: unit rotation x lever
        to_tip = np.hstack((np.eye(3), turn.T))  # tip motion per platform twist
        out[i] = to_tip @ np.linalg.solve(K[i] - load_stiffness(R, tool, state.force[i]), to_tip.T)
    return out


def chain_shifts(machine: Machine, tips: Array) -> Array:
    """Shift (n, c, 6) of every free chain's end by its own geometric error at tips (n, 3): eps_i of eq. (6)."""
    P = build_machine(machine.robot, machine.nominal).elastic
    perfect = build_machine(machine.nominal, machine.nominal)
    state = solve(perfect, FREE, tips, check=False, keep=True)
    out = np.zeros((len(tips), len(machine.robot.chains), 6))
    for i in range(len(tips)):
        for c in range(out.shape[1]):
            R0, p0 = walk(perfect.elastic, c, state.x[i, c], new_slots(perfect.elastic, c))
            R1, p1 = walk(P, c, state.x[i, c], new_slots(P, c))
            out[i, c] = np.concatenate((p1 - p0, log_rotation(R1 @ R0.T)))
    return out


def assembly_shift(stiffness: Array, shifts: Array) -> tuple[Array, Array]:
    """Platform displacement (n, 6) and internal wrenches (n, c, 6) from chain errors, to first order: eq. (7).

    stiffness (n, c, 6, 6) of the chains, shifts (n, c, 6): dt = (sum K_i)^-1 sum K_i eps_i, F_i = K_i (dt - eps_i).
    """
    total = np.einsum("ncij,ncj->ni", stiffness, shifts)
    dt = np.linalg.solve(stiffness.sum(axis=1), total[..., None])[..., 0]
    return dt, np.einsum("ncij,ncj->nci", stiffness, dt[:, None, :] - shifts)
