"""Frames and tools that a machine file states for programs in the language of the robot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camcomp.gcode.robot_frames import CoordinateFrame, JointPose, RobotFrames, zyx_rotations
from camcomp.model.config.spec import Config, RobotFrame
from camcomp.model.job import Job
from camcomp.model.statics.arm import NEAR_SINGULAR, arm_of, dexterity, end_pose

SAME_JOINT_RAD = 1e-6  # between given joints and those that the inverse kinematics finds for their pose


def robot_frames(config: Config) -> RobotFrames:
    """Program frame, flange, tool, and the numbered frames of a machine file."""
    job = Job(config)
    nominal = job.machine.nominal
    flange = zyx_rotations(np.array([config.control.flange_abc_deg], float))[0]
    held = nominal.held_rotation if len(nominal.actuators) == 6 else np.eye(3)
    return RobotFrames(
        program=CoordinateFrame(job.frame.rotation, job.frame.origin),
        held=held,
        flange=flange,
        tip=flange.T @ nominal.tool,
        bases={number: _frame(each) for number, each in config.control.base_frames.items()},
        tools={number: _frame(each) for number, each in config.control.tool_frames.items()},
        pose_of_joints=lambda angles: _pose_of_joints(job, angles),
    )


def _frame(given: RobotFrame) -> CoordinateFrame:
    return CoordinateFrame.of(given.origin_mm, given.abc_deg)


def _pose_of_joints(job: Job, angles_deg: Sequence[float]) -> JointPose:
    """The pose of joint angles by the kinematics of the control, and why it cannot be followed from there."""
    arm = arm_of(job.machine.nominal)
    if arm is None or len(angles_deg) != len(arm.actuators):
        return JointPose(np.zeros(3), np.eye(3), "the machine is no arm with as many joints")
    q = np.where(job.machine.revolute, np.radians(angles_deg), angles_deg)
    rotation, reference = end_pose(arm, q)
    tip = reference + rotation @ job.machine.nominal.tool
    why = ""
    if dexterity(arm, q[None])[0] < NEAR_SINGULAR:
        why = "the arm is near a singular configuration there"
    elif (form := job.machine.closed_form) is not None:
        own = form.near(rotation, reference)
        if own is None or np.abs(own - q).max() > SAME_JOINT_RAD:
            why = "they are another posture than start_deg of the machine file"
    return JointPose(tip, rotation, why)
