"""Kinematics that the control of an arm knows: start pose, Jacobian, room to singular configurations, held orientation."""

import numpy as np
import pytest

from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.statics.arm import arm_of, dexterity, end_pose, follow, jacobian, rotation_vector
from camcomp.model.statics.build import held_orientation
from camcomp.model.statics.rotation import exp_rotation


@pytest.fixture(scope="module")
def kuka():
    return Job(load_config(["config/kuka-kr210.yaml"]))


def test_start_pose_follows_from_start_angles(kuka):
    # Elbow up: forearm level at shoulder height + upper arm - elbow offset, spindle plate one hand length below.
    robot = kuka.machine.nominal
    np.testing.assert_allclose(robot.start_reference, [350 + 1200, 0, 225.6 + 449.4 + 1150 - 41 - 420], atol=1e-9)
    np.testing.assert_allclose(robot.start_rotation, np.eye(3), atol=1e-12)


def test_jacobian_is_the_derivative_of_the_pose(kuka):
    arm = arm_of(kuka.machine.nominal)
    q = arm.start + np.array([0.3, -0.2, 0.1, 0.5, -0.4, 0.7])
    _, p = end_pose(arm, q)
    assert np.linalg.norm(p) > 500.0
    for k in range(6):
        h = 1e-6 * np.eye(6)[k]
        (Rp, pp), (Rm, pm) = end_pose(arm, q + h), end_pose(arm, q - h)
        want = np.concatenate(((pp - pm) / 2e-6, rotation_vector(Rp @ Rm.T) / 2e-6))
        np.testing.assert_allclose(jacobian(arm, q)[:, k], want, atol=2e-4)


def test_dexterity_vanishes_with_a_straight_wrist_and_a_straight_elbow(kuka):
    arm = arm_of(kuka.machine.nominal)
    straight = arm.start.copy()
    straight[4] = 0.0
    stretched = arm.start.copy()
    stretched[2] = -np.arctan2(41.0, 1200.0)  # wrist centre on the line shoulder - elbow
    poses = np.stack((arm.start, straight, stretched))
    room = dexterity(arm, poses)
    assert room[0] > 0.1
    assert room[1] < 1e-12
    assert room[2] < 1e-12


def test_follow_keeps_the_branch_and_meets_the_pose(kuka):
    arm = arm_of(kuka.machine.nominal)
    R, p = end_pose(arm, arm.start)
    goal = p + [200.0, -300.0, -400.0]
    q = follow(arm, arm.start, R, p, goal)
    reached = end_pose(arm, q)
    np.testing.assert_allclose(reached[1], goal, atol=1e-6)
    np.testing.assert_allclose(reached[0], R, atol=1e-9)
    assert q[4] > 0  # the wrist has not flipped


def test_held_orientation_takes_the_tool_axis_from_the_program_and_the_turn_from_the_start_pose(kuka):
    robot = kuka.machine.nominal
    tilted = exp_rotation(np.array([0.2, -0.1, 0.4]))
    held = held_orientation(robot, tilted, None)
    np.testing.assert_allclose(held[:, 2], tilted[:, 2], atol=1e-12)
    np.testing.assert_allclose(held.T @ held, np.eye(3), atol=1e-12)
    assert np.linalg.det(held) > 0
    assert held[:, 0] @ robot.start_rotation[:, 0] > 0.95
    assert abs(held[:, 1] @ robot.start_rotation[:, 0]) < 1e-12  # x is as near to where it was as it can be
    np.testing.assert_allclose(held_orientation(robot, tilted, 30.0), tilted @ exp_rotation(np.radians([0, 0, 30.0])))
    turned = tilted @ exp_rotation(np.radians([0, 0, 90.0]))  # workpiece turned on the table: the posture stays
    np.testing.assert_allclose(held_orientation(robot, turned, None), held, atol=1e-12)
