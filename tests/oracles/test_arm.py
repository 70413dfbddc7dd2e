"""A six-axis arm under its own weight and cutting forces against the energy plant, which shares no code with it."""

import numpy as np
import pytest

from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.statics.target import correct, settle
from tests.commandline import compensated
from tests.validation.plants import kuka, serial

TIP_MM = 2e-4  # 0.2 um
TORQUE_NMM = 100.0  # 0.1 N m


@pytest.fixture(scope="module")
def job():
    return Job(load_config(["config/kuka-kr210.yaml"]))


def tips(n, seed=3):
    """Tool tips over a cube of 0.8 m in front of the arm, machine frame."""
    return np.random.default_rng(seed).uniform([1200, -400, 500], [2000, 400, 1300], (n, 3))


def loads(n):
    phi = np.linspace(0.0, 6 * np.pi, n)
    return np.column_stack((215 * np.cos(phi), 215 * np.sin(phi), np.full(n, -25.0)))


def test_loaded_tip_torques_and_tilt(job):
    tip, force = tips(60), loads(60)
    mine, state = settle(job.machine, tip, force)
    assert (state.status == 0).all()
    truth = serial.settle(kuka.arm(), state.rho, force)
    assert np.abs(mine - tip).max() > 0.5  # the arm sags: there is something to be right about
    assert np.abs(mine - truth.tip).max() < TIP_MM
    assert np.abs(state.drive - truth.drive).max() < TORQUE_NMM
    np.testing.assert_allclose(state.tilt, truth.tilt, atol=1e-9)
    rigid = serial.settle(kuka.arm(weights=False), state.rho, np.zeros(3))
    assert np.abs(rigid.tip - tip).max() < 1e-6  # inverse kinematics
    np.testing.assert_allclose(rigid.orientation, np.broadcast_to(np.eye(3), (60, 3, 3)), atol=1e-9)


def test_whole_pose_correction_leaves_neither_error_nor_tilt(job):
    tip, force = tips(40, 5), loads(40)
    exact = correct(job.machine, tip, force, pose=True)
    truth = serial.settle(kuka.arm(), exact.rho, force)
    assert np.abs(truth.tip - tip).max() < TIP_MM
    assert np.abs(truth.orientation - np.eye(3)).max() < 1e-7
    assert np.abs(truth.drive - exact.drive).max() < TORQUE_NMM
    tip_only = correct(job.machine, tip, force)
    truth = serial.settle(kuka.arm(), tip_only.rho, force)
    assert np.abs(truth.tip - tip).max() < TIP_MM
    assert np.abs(truth.orientation - np.eye(3)).max() > 1e-4


def test_stiffness_and_fixed_point_iterations_end_at_the_same_command(job):
    tip, force = tips(10, 7), loads(10)
    want = correct(job.machine, tip, force).commanded
    for method in ("stiffness", "fixed-point"):
        result = correct(job.machine, tip, force, method=method)
        assert (result.status == 0).all()
        np.testing.assert_allclose(result.commanded, want, atol=1e-5)


def test_drive_torques_and_tip_motion_are_reciprocal(job):
    """Virtual work: the drives feel a tip force by as much as their turns move the tip, d(drive)/dF = -(d tip/d rho)^T."""
    from camcomp.model.statics.solve import FREE, solve

    tip, force = tips(8, 11), loads(8)
    rho = solve(job.machine, FREE, tip, force=force).rho
    for a in range(6):
        h = 1e-5 * np.eye(6)[a]
        plus, minus = (solve(job.machine, FREE, tip, force=force, rho=rho + s * h).tip for s in (1, -1))
        by_turn = (plus - minus) / 2e-5
        by_force = np.empty((8, 3))
        for i in range(3):
            f = 10.0 * np.eye(3)[i]
            plus, minus = (solve(job.machine, FREE, tip, force=force + s * f, rho=rho).drive[:, a] for s in (1, -1))
            by_force[:, i] = (plus - minus) / 20.0
        np.testing.assert_allclose(by_force, -by_turn, rtol=1e-5, atol=1e-3)


def test_work_of_the_drives_round_a_loop_is_zero(job):
    """Dead loads and springs store no work: what the drives put in on a closed loop they get back."""
    from camcomp.model.statics.solve import FREE, solve

    phi = np.linspace(0.0, 2 * np.pi, 49)
    ring = np.array([1550.0, 0.0, 900.0]) + 150.0 * np.column_stack((np.cos(phi), np.sin(phi), np.sin(2 * phi)))
    state = solve(job.machine, FREE, ring, force=np.array([215.0, -10.0, -25.0]))
    turn = np.stack([np.gradient(each, phi) for each in state.rho.T], axis=1)
    slope = np.stack([periodic_slope(each) for each in state.rho.T], axis=1)
    assert np.abs(turn - slope).max() < 0.05  # the same thing, one of them to all digits
    power = (state.drive * slope).sum(axis=1)[:-1]
    work = power.sum() * 2 * np.pi / 48
    exchanged = np.abs(power).sum() * 2 * np.pi / 48
    assert exchanged > 1e4  # N mm
    assert abs(work) < 1e-7 * exchanged


def periodic_slope(values):
    """Derivative by the angle of one period (end point repeated), exact for harmonics that the points resolve."""
    coefficients = np.fft.rfft(values[:-1])
    slope = np.fft.irfft(1j * np.arange(len(coefficients)) * coefficients, len(values) - 1)
    return np.append(slope, slope[0])


def test_groove_through_the_command_line(tmp_path):
    done, joints, _, summary, text = compensated(tmp_path, "samples/groove-circle-50.nc", "config/kuka-kr210.yaml")
    assert done.returncode == 0, done.stderr.decode()
    names = [f"A{k}" for k in range(1, 7)]
    rho = np.stack([joints[f"act_{n}_rad"] for n in names], axis=1)
    nominal = np.stack([joints[f"act_{n}_nominal_rad"] for n in names], axis=1)
    drive = np.stack([joints[f"act_{n}_Nmm"] for n in names], axis=1)
    force = np.stack([joints[f"f{axis}_N"] for axis in "xyz"], axis=1)
    goal = np.stack([joints[f"{axis}_mm"] for axis in "xyz"], axis=1) + [1550.0, 0.0, 800.0]
    truth = serial.settle(kuka.arm(), rho, force)
    assert np.abs(truth.tip - goal).max() < TIP_MM
    assert np.abs(truth.drive - drive).max() < TORQUE_NMM
    assert np.abs(truth.orientation - np.eye(3)).max() < 1e-5
    plain = serial.settle(kuka.arm(), nominal, force)
    before = np.linalg.norm(plain.tip - goal, axis=1)
    assert summary["before"]["max_um"] == pytest.approx(1e3 * before[2:-1].max(), rel=0.02)
    assert summary["after"]["max_um"] <= 1.0
    assert summary["before"]["rms_um"] > 1000.0
    assert summary["actuator_change_max_rad"] == pytest.approx(np.abs(rho - nominal).max(), rel=1e-2)
    assert summary["actuator_torque_max_Nmm"] == pytest.approx(np.abs(drive).max(), rel=1e-3)
    assert np.abs(np.diff(rho, axis=0)).max() < 0.05  # one branch, no jump
    assert b"X" in text
