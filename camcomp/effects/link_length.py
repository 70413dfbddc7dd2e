"""A link is longer than stated: the first arm or rigid step behind the actuator."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from camcomp.effects._aim import place
from camcomp.model.effect import Parameter
from camcomp.model.statics.description import Actuator, Element, Parallelogram, Robot, Transform

STAGE = "structure"
TARGET = "actuator"
PLAIN = "a link longer than stated"
REMEDY = "measure the link and state its length in the machine file"
SOURCE = "definition: the link that the actuator drives, lengthened along itself"
PARAMETERS = (Parameter("length_mm", "mm", 0.0, -10.0, 10.0, 0.1, 0.0003, "links made to 0.02 to 0.3 mm"),)


def _longer(each: Element, length: float) -> Element | None:
    """The element with its step lengthened, None where it has no step."""
    if isinstance(each, Parallelogram):
        step = float(np.linalg.norm(each.arm))
        return replace(each, arm=each.arm * ((step + length) / step))
    if isinstance(each, Transform):
        step = float(np.linalg.norm(each.translation))
        return None if step == 0.0 else replace(each, translation=each.translation * ((step + length) / step))
    return None


def on_robot(robot: Robot, actuators: tuple[str, ...], p: Mapping[str, float]) -> Robot:
    """Copy of the machine with the links behind these actuators lengthened."""
    length = p["length_mm"]
    if length == 0.0:
        return robot
    for name in actuators:
        chain, k = place(robot, name)
        for i in range(k + 1, len(chain.elements)):
            if isinstance(chain.elements[i], Actuator):
                break
            longer = _longer(chain.elements[i], length)
            if longer is not None:
                elements = (*chain.elements[:i], longer, *chain.elements[i + 1 :])
                robot = robot.edit_chain(chain.name, elements=elements)
                break
    return robot
