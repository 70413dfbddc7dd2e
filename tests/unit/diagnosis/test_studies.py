"""The two studies of logs without a program on data whose truth is known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from camcomp.diagnosis.arm.poses import Poses
from camcomp.diagnosis.arm.registration import register
from camcomp.diagnosis.arm.study import study as arm_study
from camcomp.diagnosis.axis.study import AxisRun
from camcomp.diagnosis.axis.study import study as axis_study
from camcomp.model.config.load import load_config
from camcomp.model.statics.build import build_robot
from tests.plants import serial

UR10 = ((0, 90, 127.3), (-612, 0, 0), (-572.3, 0, 0), (0, 90, 163.941), (0, -90, 115.7), (0, 0, 92.2))
MASS = (
    (7.1, (21, 0, 27)),
    (12.7, (380, 0, 158)),
    (4.27, (240, 0, 68)),
    (2.0, (0, 7, 18)),
    (2.0, (0, 7, 18)),
    (0.365, (0, 0, -26)),
)


def measured(q, seed, *, longer=0.0, soft=0.0, offset=0.0, noise=0.02):
    """Tracker points of the energy plant's UR10: elbow link longer, shoulder lift soft (rad/Nmm), elbow off by an angle."""
    arm = []
    for i, ((a, alpha, d), (kg, centre)) in enumerate(zip(UR10, MASS, strict=True)):
        arm.append(serial.Joint("turn", 2, 1.0 / soft if i == 1 and soft else None))
        turn = Rotation.from_euler("X", alpha, degrees=True).as_rotvec()
        arm += [serial.Shift((a - longer if i == 2 else a, 0.0, d), tuple(turn)), serial.Weight(kg * 9.80665, centre)]
    arm.append(serial.Shift((3.0, -4.0, 90.0)))
    rng = np.random.default_rng(seed)
    tip = serial.settle(arm, q + offset * np.eye(6)[2], np.zeros(3)).tip
    frame = Rotation.from_euler("XYZ", rng.uniform(-0.3, 0.3, 3))
    return frame.apply(tip) + rng.uniform(-3000, 3000, 3) + noise * rng.standard_normal(tip.shape)


def run(name, seed, low, high, **truth):
    q = np.random.default_rng(seed).uniform(low, high, (250, 6))
    return Poses(name, q, measured(q, seed, **truth), np.arange(250.0), None, np.full(250, name))


@pytest.fixture(scope="module")
def robot():
    return build_robot(load_config(["config/ur10.yaml"]).robot, [0.0, 0.0, 0.0])[0]


A, B = ([-2, -2.5, -2, -3, -2, -3], [1, -0.3, 2, 3, 2, 3]), ([-1, -1.8, -1, -2, -1, -2], [2, 0.1, 1.5, 1, 2.5, 2])


def test_a_longer_link_and_a_soft_joint_are_found_on_other_campaigns(robot):
    truth = {"longer": 0.7, "soft": 1.2e-8}
    result = arm_study(robot, (), [run("A", 1, *A, **truth), run("B", 2, *B, **truth)], holdout=["B"])
    assert result.verdict == "identified"
    assert {c.effect for c in result.causes} == {"link_length", "gravity_compliance"}
    longer = next(c for c in result.causes if c.effect == "link_length" and c.target == "elbow")
    assert longer.parameters["length_mm"].value == pytest.approx(0.7, rel=0.05)
    soft = next(c for c in result.causes if c.effect == "gravity_compliance")
    assert soft.target == "shoulder_lift"
    assert soft.parameters["compliance_rad_per_Nmm"].value == pytest.approx(1.2e-8, rel=0.05)
    assert result.shrinkage.after_rms_um == pytest.approx(20 * np.sqrt(3), rel=0.15)  # the noise put in
    assert result.gap.noise_floor_um == pytest.approx(20 * np.sqrt(3), rel=0.2)


def test_an_arm_that_is_its_model_has_no_cause(robot):
    result = arm_study(robot, (), [run("A", 3, *A), run("B", 4, *B)])
    assert result.verdict == "none"
    assert result.causes == ()
    assert result.gap.rms_um == pytest.approx(20 * np.sqrt(3), rel=0.1)


def test_registration_finds_frame_and_tool():
    rng = np.random.default_rng(5)
    point, pose = rng.uniform(-800, 800, (50, 3)), Rotation.random(50, rng).as_matrix()
    frame = Rotation.from_euler("XYZ", [2.0, -1.0, 3.0])
    found = register(
        frame.apply(point + pose @ [10.0, -20.0, 150.0]) + [1000.0, -2000.0, 300.0], point, pose, np.zeros(3)
    )
    np.testing.assert_allclose(found.rotation, frame.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(found.tool, [10.0, -20.0, 150.0], atol=1e-6)
    np.testing.assert_allclose(found.origin, [1000.0, -2000.0, 300.0], atol=1e-6)


def axis_log(lag=0.005, coulomb=30.0, viscous=0.1, lopsided=0.0, line=0.0, seed=0):
    t = np.arange(0.0, 16.0, 1e-3)
    position = 100 * np.sin(0.9 * t) + 40 * np.sin(2.3 * t + 0.4)
    speed = 90 * np.cos(0.9 * t) + 92 * np.cos(2.3 * t + 0.4)
    push = -81 * np.sin(0.9 * t) - 92 * 2.3 * np.sin(2.3 * t + 0.4)
    rng = np.random.default_rng(seed)
    force = 0.08 * push + coulomb * np.tanh(speed / 0.5) + viscous * speed + lopsided * np.abs(speed)
    force += line * np.sin(2 * np.pi * position / 5.0) + 0.5 * rng.standard_normal(len(t))
    setpoint = position + lag * speed + 5e-4 * rng.standard_normal(len(t))
    return AxisRun("r", t, setpoint, position, force)


def test_an_axis_with_lag_friction_and_an_unlisted_ripple():
    result = axis_study({"x": [axis_log(lopsided=-0.03, line=2.0)]})
    parameters = {c.effect: c.parameters for c in result.causes}
    assert parameters["servo_lag"]["time_constant_ms"].value == pytest.approx(5.0, rel=0.01)
    assert parameters["friction"]["force_N"].value == pytest.approx(30.0, rel=0.03)
    assert parameters["friction"]["asymmetry_Ns_per_mm"].value == pytest.approx(-0.03, rel=0.1)
    assert result.verdict == "unknown"
    line = result.where.drivers[0]
    assert line.period_mm == pytest.approx(5.0, rel=0.005)
    assert line.amplitude_N == pytest.approx(2.0, rel=0.1)


def test_what_is_not_there_is_not_found():
    result = axis_study({"x": [axis_log()]})
    assert {c.effect for c in result.causes} == {"servo_lag", "friction"}
    assert "asymmetry_Ns_per_mm" not in result.causes[-1].parameters
    assert result.where.drivers == ()
    assert result.verdict == "identified"
    still = axis_study({"x": [axis_log(lag=0.0, coulomb=0.0, viscous=0.0)]})
    assert still.causes == ()


def test_logs_that_say_nothing_are_refused():
    nothing = np.full(100, np.nan)
    with pytest.raises(ValueError, match="no axis"):
        axis_study({"x": [AxisRun("r", np.arange(100.0), nothing, nothing, nothing)]})
