"""The tool is longer than stated: the tip stands further out along the tool vector."""

from collections.abc import Mapping

import numpy as np

from camcomp.ground.records import replace
from camcomp.model.effect import Parameter
from camcomp.model.statics.description import Robot

STAGE = "tool"
TARGET = "machine"
PLAIN = "a tool length other than stated"
REMEDY = "measure the tool on a presetter and correct the tool table"
SOURCE = "definition"
PARAMETERS = (Parameter("length_mm", "mm", 0.0, -20.0, 20.0, 0.1, 0.0003, "tool setting: 0.02 to 0.5 mm"),)


def on_robot(robot: Robot, actuators: tuple[str, ...], p: Mapping[str, float]) -> Robot:
    """Copy of the machine with a longer tool; a machine without a tool vector grows along -z."""
    length = p["length_mm"]
    if length == 0.0:
        return robot
    stated = float(np.linalg.norm(robot.tool))
    along = robot.tool / stated if stated > 0.0 else np.array([0.0, 0.0, -1.0])
    return replace(robot, tool=robot.tool + length * along)
