"""A joint of an arm gives way under the arm's own weight, more than the model says (a model without springs: at all)."""

from collections.abc import Mapping

from camcomp.ground.records import replace
from camcomp.model.effect import Parameter
from camcomp.model.statics.description import Actuator, Robot

STAGE = "structure"
TARGET = "actuator"
PLAIN = "a joint that gives way under the arm's weight"
REMEDY = "keep the compliance in the machine file; a joint far softer than its like wants its gear looked at"
ARM_ONLY = True
SOURCE = "definition: compliance in series with the spring of the joint; the load is the weight of the links behind it"
PARAMETERS = (
    Parameter(
        "compliance_rad_per_Nmm", "rad/Nmm", 0.0, 0.0, 1e-5, 2e-8, 2e-10,
        "gear joints of arms of 10 to 250 kg payload: 3e-10 to 1e-7 rad/(N mm)", sign=1,
    ),
)  # fmt: skip
ROTARY = PARAMETERS


def on_robot(robot: Robot, actuators: tuple[str, ...], p: Mapping[str, float]) -> Robot:
    """Copy of the arm with softer hinges and unchanged slides."""
    more = p["compliance_rad_per_Nmm"]
    if more == 0.0:
        return robot

    def softer(each: Actuator) -> Actuator:
        if each.name not in actuators or not each.revolute:
            return each
        stated = 0.0 if each.stiffness is None else 1.0 / each.stiffness
        return replace(each, stiffness=1.0 / (stated + more))

    return robot.edit(Actuator, softer)
