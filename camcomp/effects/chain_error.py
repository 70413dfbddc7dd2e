"""A chain is assembled with its base rolled about the axis of its actuator."""

from collections.abc import Mapping

import numpy as np

from camcomp.model.effect import Parameter
from camcomp.model.statics.description import Actuator, Robot, Transform
from camcomp.model.statics.lengths import place_of
from camcomp.model.statics.rotation import exp_rotation

STAGE = "structure"
GEOMETRY = True
TARGET = "actuator"
PLAIN = "a leg mounted at an angle"
REMEDY = "measure how the base of this leg sits and turn it back, or keep the angle in the machine file"
SOURCE = "assembly error of Klimchik et al. (ARK 2012): about 1 degree around the actuated axis"
PARAMETERS = (
    Parameter("roll_deg", "deg", 0.0, -20.0, 20.0, 0.4, 0.0006, "assembly without fixtures: 0.1 to 1 degree"),
)


def on_robot(robot: Robot, actuators: tuple[str, ...], p: Mapping[str, float]) -> Robot:
    """Copy of the machine with these chains rolled in front of their first element."""
    roll = p["roll_deg"]
    if roll == 0.0:
        return robot
    for name in actuators:
        chain, k = place_of(robot, name)
        joint = chain.elements[k]
        assert isinstance(joint, Actuator)
        turn = Transform(rotation=exp_rotation(np.radians(roll) * joint.axis))
        # In front of the actuator itself, so that in a serial machine the axis meant is the joint's own.
        robot = robot.edit_chain(chain.name, elements=(*chain.elements[:k], turn, *chain.elements[k:]))
    return robot
