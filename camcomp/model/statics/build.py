"""From the YAML specs of a robot and its tool to the descriptions that the solver packs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.records import replace
from camcomp.model.config import robot as spec
from camcomp.model.config.links import Spring
from camcomp.model.statics.arm import arm_of, end_pose
from camcomp.model.statics.description import (
    Actuator,
    Chain,
    Element,
    Link,
    Parallelogram,
    Passive,
    Robot,
    Transform,
    Weight,
)
from camcomp.model.statics.links import beam_compliance
from camcomp.model.statics.rotation import exp_rotation

Array = NDArray[np.float64]
_AXES = {"x": 0, "y": 1, "z": 2}


def axis_vector(axis: str | list[float]) -> Array:
    """Unit vector (3,) of an axis letter (x, -y, ...) or of a vector."""
    if isinstance(axis, str):
        out = np.zeros(3)
        out[_AXES[axis[-1]]] = -1.0 if axis.startswith("-") else 1.0
        return out
    vector = np.asarray(axis, float)
    found: Array = vector / np.linalg.norm(vector)
    return found


def rotation_of(vector_deg: list[float]) -> Array:
    """Rotation matrix (3, 3) of a rotation vector in degrees."""
    return exp_rotation(np.radians(np.asarray(vector_deg, float)))


def spring(given: Spring) -> Link:
    """A 6-dof spring in whichever notation it was given; a zero compliance means rigid in that direction."""
    if given.stiffness is not None:
        return Link(np.asarray(given.stiffness, float))
    if given.stiffness_diagonal is not None:
        d = given.stiffness_diagonal
        return Link(np.diag([*d.translation_N_per_mm, *d.rotation_Nmm_per_rad]))
    if given.beam is not None:
        b = given.beam
        A, Iy, Iz, J = b.section.moments()
        C = beam_compliance(length=b.length_mm, E=b.E_N_per_mm2, G=b.shear_modulus, A=A, Iy=Iy, Iz=Iz, J=J)
        return Link(np.asarray(np.linalg.inv(C), float))
    if given.compliance is not None:
        C = np.asarray(given.compliance, float)
    else:
        c = given.compliance_diagonal
        assert c is not None  # exactly one notation is given: checked when the file was read
        C = np.diag([*c.translation_mm_per_N, *c.rotation_rad_per_Nmm])
    active = tuple(int(i) for i in np.flatnonzero(np.diag(C) > 0.0))
    K = np.zeros((6, 6))
    K[np.ix_(active, active)] = np.linalg.inv(C[np.ix_(active, active)])
    return Link(K, active)


def _element(given: spec.Element, chain: str) -> Element:
    if isinstance(given, spec.TransformSpec):
        return Transform(np.asarray(given.translation_mm, float), rotation_of(given.rotation_deg))
    if isinstance(given, spec.PrismaticActuator | spec.RevoluteActuator):
        return Actuator(
            name=given.name or chain, revolute=given.rotary, axis=axis_vector(given.axis), stiffness=given.stiffness,
            home=given.home, limits=given.limits or (-np.inf, np.inf), start=given.start,
        )  # fmt: skip
    if isinstance(given, spec.PrismaticPassive | spec.RevolutePassive):
        return Passive(given.rotary, axis_vector(given.axis), given.stiffness or 0.0, given.rest, given.start)
    if isinstance(given, spec.LinkSpec):
        return spring(given)
    if isinstance(given, spec.ParallelogramSpec):
        bar = spring(given.bar).stiffness
        arm = np.asarray(given.arm_mm, float)
        return Parallelogram(
            arm=arm, hinge=axis_vector(given.hinge), crossbar=axis_vector(given.crossbar), width=given.width_mm,
            bar_stiffness=bar, start=given.start,
        )  # fmt: skip
    return Weight(np.array([0.0, 0.0, -given.force_N]), np.asarray(given.centre_mm, float))


def _six(error: spec.GeometricError) -> Array:
    return np.array([*error.translation_mm, *np.radians(error.rotation_deg)])


def build_robot(given: spec.RobotSpec, tip_mm: list[float]) -> tuple[Robot, Robot]:
    """The true robot, and the robot of the controller's kinematics (perfect chains).

    tip_mm (3,): tool tip seen from the platform reference point. Source of the distinction: chain errors are unknown to
    the inverse kinematics of the controller (Klimchik et al. 2012, section 2).
    """
    chains = []
    for name, chain in given.chains.items():
        order = [_AXES[letter] for letter in chain.frame]
        chains.append(
            Chain(
                name,
                tuple(_element(e, name) for e in chain.elements),
                np.eye(3)[:, order],
                _six(chain.base_error),
                _six(chain.end_error),
            )
        )
    tool, start = np.asarray(tip_mm, float), np.asarray(given.start_reference_mm, float)
    robot = Robot(name=given.name, chains=tuple(chains), tool=tool, start_reference=start)
    nominal = perfect(robot)
    arm = arm_of(nominal)
    if arm is not None:
        rotation, point = end_pose(arm, arm.start)
        robot, nominal = (replace(each, start_reference=point, start_rotation=rotation) for each in (robot, nominal))
    return robot, nominal


def held_orientation(robot: Robot, program: Array, turn_deg: float | None) -> Array:
    """Orientation (3, 3) in which a machine with six actuators keeps its platform along a path.

    program (3, 3): program frame in the machine frame. The platform's z axis (away from the workpiece) is the program's Z.
    The rotation about it is free: its x axis is at turn_deg from program X, or as near as possible to its direction in
    the start pose, so that every program is milled in the posture in which the arm was set up.
    """
    if turn_deg is not None:
        c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
        out: Array = program @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return out
    z = program[:, 2]
    x = robot.start_rotation[:, 0] - z * (z @ robot.start_rotation[:, 0])
    if np.linalg.norm(x) < 0.1:  # the start pose's x axis points along the tool: its y axis decides instead
        y = robot.start_rotation[:, 1] - z * (z @ robot.start_rotation[:, 1])
        x = np.cross(y, z)
    x /= np.linalg.norm(x)
    return np.column_stack((x, np.cross(z, x), z))


def perfect(robot: Robot) -> Robot:
    """The same robot without chain errors."""
    out = robot
    for chain in robot.chains:
        out = out.edit_chain(chain.name, base_error=np.zeros(6), end_error=np.zeros(6))
    return out
