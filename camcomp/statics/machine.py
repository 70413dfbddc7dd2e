"""A machine ready to be solved: the packed elastic model and the rigid model that its control uses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from camcomp.statics.description import Robot
from camcomp.statics.kernel import jacobian, new_slots, walk
from camcomp.statics.pack import END_COMPLIANCE, LENGTH, PRISMATIC, REVOLUTE, Packed, pack

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Machine:
    """Packed robot. robot: what is; nominal: what the control believes (perfect chains, nominal lengths)."""

    robot: Robot
    nominal: Robot
    elastic: Packed
    rigid: Packed
    joint_var: NDArray[np.int64]  # (c, rigid variables) -> variable of the elastic chain

    @property
    def actuators(self) -> tuple[str, ...]:
        """Names of the actuators, in the order of every actuator array."""
        return tuple(a.name for a in self.robot.actuators)

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
    """Packs a robot. nominal: the robot as its control knows it, by default the same one.

    Raises ValueError if the machine has neither three nor six actuators, or none of its chains is complete.
    """
    m = len(robot.actuators)
    if m not in (3, 6):
        raise ValueError(f"{m} actuators; a machine needs three (tip position) or six (tip pose)")
    nominal = robot if nominal is None else nominal
    elastic = pack(robot, rigid=False)
    rigid = pack(nominal, rigid=True)
    joint_var = np.full((len(robot.chains), rigid.start.shape[1]), -1, np.int64)
    for c in range(len(robot.chains)):
        joints = [_joints(P, c) for P in (rigid, elastic)]
        for a, b in zip(*joints, strict=True):
            joint_var[c, a] = b
        elastic.end_compliance[c] = END_COMPLIANCE if _has_rigid_direction(elastic, c) else 0.0
    return Machine(robot, nominal, elastic, rigid, joint_var)


def _joints(P: Packed, c: int) -> list[int]:
    """Variables of the joints of chain c, base to end, each once."""
    seen: list[int] = []
    for e in range(P.first[c], P.first[c + 1]):
        if P.kind[e] in (PRISMATIC, REVOLUTE) and P.var[e] not in seen:
            seen.append(int(P.var[e]))
    return seen


def _has_rigid_direction(P: Packed, c: int) -> bool:
    """True if some end motion of chain c is held by no spring and no joint at the start pose."""
    slots = new_slots(P, c)
    J = np.zeros((6, P.nvar[c]))
    _, p = walk(P, c, P.start[c], slots)
    jacobian(J, p, slots)
    J[3:] *= LENGTH
    size = np.linalg.norm(J, axis=0)
    return bool(np.linalg.matrix_rank(J[:, size > 0] / size[size > 0], tol=1e-9) < 6)


