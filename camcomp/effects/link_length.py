"""A link is longer than stated: the first arm or rigid step behind the actuator."""

from collections.abc import Mapping

from camcomp.model.effect import Parameter
from camcomp.model.statics.description import Robot
from camcomp.model.statics.lengths import lengthened

STAGE = "structure"
GEOMETRY = True
TARGET = "actuator"
PLAIN = "a link longer than stated"
REMEDY = "measure the link and state its length in the machine file"
SOURCE = "definition: the link that the actuator drives, lengthened along itself"
PARAMETERS = (Parameter("length_mm", "mm", 0.0, -10.0, 10.0, 0.1, 0.0003, "links made to 0.02 to 0.3 mm"),)


def on_robot(robot: Robot, actuators: tuple[str, ...], p: Mapping[str, float]) -> Robot:
    """Copy of the machine with the links behind these actuators lengthened."""
    length = p["length_mm"]
    if length == 0.0:
        return robot
    for name in actuators:
        robot = lengthened(robot, name, length)
    return robot
