"""A machine ready to be solved: the packed elastic model and the rigid model of its controller."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.records import dataclass
from camcomp.model.statics.arm import arm_of
from camcomp.model.statics.closedform import ClosedForm, closed_form
from camcomp.model.statics.description import Robot
from camcomp.model.statics.layout import Packed
from camcomp.model.statics.pack import pack

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Machine:
    """Packed robot. robot: the true one; nominal: that of the controller (perfect chains, nominal lengths)."""

    robot: Robot
    nominal: Robot
    elastic: Packed
    rigid: Packed
    joint_var: NDArray[np.int64]  # (c, rigid variables) -> entry in z of the elastic chain, -1 none
    start_y: Array  # (c, rigid variables) nominal joint coordinates at the start pose
    answers: Any = None  # solves FREE and TARGET without wrench by interpolation; None: exactly

    @property
    def actuators(self) -> tuple[str, ...]:
        """Names of the actuators, in the order of every actuator array."""
        return tuple(a.name for a in self.robot.actuators)

    @property
    def start_pose(self) -> Array:
        """(12,) nominal platform at the start: rotation row by row, position."""
        return np.concatenate((self.nominal.start_rotation.ravel(), self.nominal.start_reference))

    @cached_property
    def closed_form(self) -> ClosedForm | None:
        """Inverse kinematics of the controller in closed form, if the arm has one."""
        arm = arm_of(self.nominal)
        return None if arm is None else closed_form(arm)

    @property
    def limits(self) -> Array:
        """(m, 2) travel limits, mm or rad."""
        return np.array([a.limits for a in self.robot.actuators])

    @property
    def home(self) -> Array:
        """(m,) home coordinates, mm or rad."""
        return np.array([a.home for a in self.robot.actuators])

    @property
    def revolute(self) -> NDArray[np.bool_]:
        """(m,) True for rotary actuators."""
        return np.array([a.revolute for a in self.robot.actuators])


def build_machine(robot: Robot, nominal: Robot | None = None) -> Machine:
    """Pack a robot. nominal: the robot of the controller's kinematics, default: the same one.

    Raises ValueError if the machine has neither three nor six actuators, or none of its chains is complete.
    """
    m = len(robot.actuators)
    if m not in (3, 6):
        raise ValueError(f"{m} actuators; a machine needs three (tip position) or six (tip pose)")
    nominal = robot if nominal is None else nominal
    elastic, rigid = pack(robot, rigid=False), pack(nominal, rigid=True)
    joint_var = np.full(rigid.start.shape, -1, np.int64)
    for row, own, other in zip(joint_var, rigid.joints, elastic.joints, strict=True):
        row[own] = other
    return Machine(
        robot=robot,
        nominal=nominal,
        elastic=elastic.packed,
        rigid=rigid.packed,
        joint_var=joint_var,
        start_y=rigid.start,
    )
