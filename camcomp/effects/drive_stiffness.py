"""The drive spring (screw, nut, bearings) is softer or stiffer than stated."""

from collections.abc import Mapping

from camcomp.ground.records import replace
from camcomp.model.effect import Parameter
from camcomp.model.statics.description import Actuator, Robot

STAGE = "structure"
TARGET = "actuator"
PLAIN = "a drive softer or stiffer than stated"
REMEDY = "push the carriage with a known force against a dial gauge; look at coupling, thrust bearing and nut"
SOURCE = "definition: factor on the spring of the actuator"
PARAMETERS = (
    Parameter(
        "factor", "1", 1.0, 0.02, 20.0, 0.4, 0.004, "axial stiffness of feed drives is known to -50 .. +100 %", log=True
    ),
)


def on_robot(robot: Robot, actuators: tuple[str, ...], p: Mapping[str, float]) -> Robot:
    """Copy of the machine with the springs of these actuators scaled."""
    factor = p["factor"]
    if factor == 1.0:
        return robot

    def scaled(each: Actuator) -> Actuator:
        if each.name not in actuators or each.stiffness is None:
            return each
        return replace(each, stiffness=each.stiffness * factor)

    return robot.edit(Actuator, scaled)
