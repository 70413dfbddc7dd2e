"""Cartesian stiffness by law: finite differences, symmetry, sums, the seed's eqs. (6)-(7), printed values."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.statics.gradients import ends_many
from camcomp.model.statics.layout import new_work
from camcomp.model.statics.machine import build_machine
from camcomp.model.statics.rotation import rotation_vectors
from camcomp.model.statics.solve import CLAMP, FREE, solve
from camcomp.model.statics.stiffness import (
    assembly_shift,
    loaded_stiffness,
    tip_compliance,
    unloaded_stiffness,
)

FORCE = np.array([[215.0, -10.0, -25.0]])
Q1 = np.array([[-73.205, -73.205, -173.205]])


def machine_of(name):
    return Job(load_config([f"config/{name}.yaml"])).machine


def chain_shifts(machine, tips):
    """Shift (n, c, 6) of every free chain's end by its own geometric error at tips (n, 3): eps_i of eq. (6)."""
    perfect = build_machine(machine.nominal, machine.nominal)
    state = solve(perfect, FREE, tips, check=False, keep=True)
    ends = []
    for model in (perfect, build_machine(machine.robot, machine.nominal)):
        ends.append(np.zeros((*state.x.shape[:2], 12)))
        ends_many(model.elastic, state.x, ends[-1], new_work(model.elastic, model.rigid))
    R0, R1 = (e[..., :9].reshape(*e.shape[:2], 3, 3) for e in ends)
    return np.concatenate((ends[1][..., 9:] - ends[0][..., 9:], rotation_vectors(R1 @ R0.swapaxes(-1, -2))), axis=-1)


def turned(R, w):
    angle = np.linalg.norm(w)
    x = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    return (np.eye(3) + np.sinc(angle / np.pi) * x + 0.5 * np.sinc(angle / 2 / np.pi) ** 2 * (x @ x)) @ R


def clamped_wrench(machine, state, dp, w):
    """Total wrench at the platform reference with the pose of the state moved by dp and turned by w."""
    R = turned(state.rotation[0], w)
    reference = state.tip[0] - state.rotation[0] @ machine.robot.tool + dp
    tip = reference + R @ machine.robot.tool
    held = solve(
        machine, CLAMP, state.commanded, aim=tip[None], aim_rotation=R[None], rho=state.rho, check=False, keep=True
    )
    assert held.status[0] == 0
    return held.F[0].sum(axis=0)


@pytest.mark.parametrize("name", ["orthoglide", "orthoglide-1deg", "puu"])
@pytest.mark.parametrize("times", [1.0, 5.0])
def test_loaded_stiffness_is_the_derivative_of_the_wrench(name, times):
    machine = machine_of(name)
    state = solve(machine, FREE, Q1, force=times * FORCE, keep=True)
    K = loaded_stiffness(machine, state).machine[0]
    scale = np.array([1.0, 1.0, 1.0, 100.0, 100.0, 100.0])  # mm against rad
    measured = np.zeros((6, 6))
    h = 1e-3
    for j in range(6):
        step = np.zeros(6)
        step[j] = h / scale[j]
        plus = clamped_wrench(machine, state, step[:3], step[3:])
        minus = clamped_wrench(machine, state, -step[:3], -step[3:])
        measured[:, j] = (plus - minus) / (2.0 * step[j])
    K, measured = K / np.outer(scale, scale), measured / np.outer(scale, scale)
    assert np.abs(K - measured).max() < 1e-6 * np.abs(K).max()


def test_load_changes_the_stiffness_and_moments_make_it_asymmetric():
    machine = machine_of("orthoglide")
    K0 = unloaded_stiffness(machine, Q1).machine[0]
    K1 = loaded_stiffness(machine, solve(machine, FREE, Q1, force=5 * FORCE, keep=True)).machine[0]
    assert np.abs(K1 - K0).max() > 1e-3 * np.abs(K0).max()
    assert np.abs(K1 - K1.T).max() > 1e-6 * np.abs(K1).max()


@pytest.mark.parametrize(("name", "rank"), [("orthoglide", 3), ("puu", 2)])
def test_unloaded_stiffness_is_symmetric_positive_and_chains_have_their_rank(name, rank):
    found = unloaded_stiffness(machine_of(name), Q1)
    scale = np.array([1.0, 1.0, 1.0, 100.0, 100.0, 100.0])
    for chain in found.chains[0]:
        K = chain / np.outer(scale, scale)
        assert np.abs(K - K.T).max() < 1e-9 * np.abs(K).max()
        values = np.linalg.eigvalsh(0.5 * (K + K.T))
        assert (values > 1e-7 * values.max()).sum() == rank and values.min() > -1e-9 * values.max()
    assert np.linalg.eigvalsh(found.machine[0] / np.outer(scale, scale)).min() > 0.0


def test_printed_stiffness_of_the_reference_puu_machine():
    at = np.array([[0.0, 0.0, -100.0], [-73.65, -73.65, -173.65], [126.35, 126.35, 26.35]])
    K = unloaded_stiffness(machine_of("puu"), at).machine
    np.testing.assert_allclose(np.diag(K[0]), [8920.299162] * 3 + [1606720.857] * 3, rtol=2e-7)
    printed = {(0, 0): 9939.663597, (0, 1): -3885.113, (3, 3): 2680374.809, (3, 4): -918334.5, (0, 4): -86265.58,
               (0, 5): 86265.58}  # fmt: skip
    for (i, j), value in printed.items():
        assert K[1][i, j] == pytest.approx(value, rel=2e-7)
    printed = {(0, 0): 12776.691, (0, 1): 10626.43, (3, 3): 5670987.24, (0, 4): 66172.89}
    for (i, j), value in printed.items():
        assert K[2][i, j] == pytest.approx(value, rel=5e-7)


def test_printed_compliances_of_the_orthoglide():
    machine = machine_of("orthoglide")
    robot = replace(machine.robot, tool=np.zeros(3))
    bare = build_machine(robot, replace(machine.nominal, tool=np.zeros(3)))
    at = np.array([[0.0, 0.0, 0.0], [-73.205] * 3, [126.795] * 3])
    state = solve(bare, FREE, at, force=np.array([1e-6, 0.0, 0.0]), keep=True)
    principal = np.linalg.eigvalsh(tip_compliance(bare, state))
    printed = 1e-4 * np.array([[2.599] * 3, [1.751, 1.751, 10.944], [0.787, 12.592, 12.592]])
    np.testing.assert_allclose(principal, printed, atol=0.00051e-4)


def test_tip_compliance_is_the_derivative_of_the_loaded_tip():
    machine = machine_of("orthoglide-1deg")
    state = solve(machine, FREE, Q1, force=FORCE, keep=True)
    C = tip_compliance(machine, state)[0]
    for j in range(3):
        step = 0.1 * np.eye(3)[j]
        plus, minus = (solve(machine, FREE, Q1, force=FORCE + s * step).tip[0] for s in (1.0, -1.0))
        np.testing.assert_allclose(C[:, j], (plus - minus) / 0.2, rtol=1e-6, atol=1e-11)


def test_scalar_example_of_equation_7():
    K = np.zeros((1, 2, 6, 6))
    K[0, 0], K[0, 1] = 100.0 * np.eye(6), 300.0 * np.eye(6)
    eps = np.zeros((1, 2, 6))
    eps[0, :, 0] = 0.1, -0.1
    dt, internal = assembly_shift(K, eps)
    assert dt[0, 0] == pytest.approx(-0.05)
    np.testing.assert_allclose(internal[0, :, 0], [-15.0, 15.0])


@pytest.mark.parametrize("name", ["orthoglide", "puu"])
def test_equations_6_and_7_agree_with_the_full_model_to_first_order(name):
    nominal = machine_of(name).nominal
    miss = []
    for degrees in (0.4, 0.2, 0.1):
        robot = nominal
        for chain in nominal.chains:
            robot = robot.edit_chain(chain.name, base_error=np.array([0, 0, 0, np.radians(degrees), 0, 0]))
        machine = build_machine(robot, nominal)
        dt, internal = assembly_shift(unloaded_stiffness(machine, Q1).chains, chain_shifts(machine, Q1))
        assert np.abs(internal.sum(axis=1)).max() < 1e-6 * np.abs(internal).max() + 1e-9
        linear = dt[0, :3] + np.cross(dt[0, 3:], machine.robot.tool)
        full = solve(machine, FREE, Q1).tip[0] - Q1[0]
        miss.append(np.linalg.norm(linear - full))
        assert miss[-1] < 0.1 * np.linalg.norm(full)
    # halving the errors quarters what the linear equations miss
    assert 3.5 < miss[0] / miss[1] < 4.5 and 3.5 < miss[1] / miss[2] < 4.5
