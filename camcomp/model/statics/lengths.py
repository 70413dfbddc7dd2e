"""Machines with links longer or shorter than stated."""

from __future__ import annotations

import numpy as np

from camcomp.ground.records import replace
from camcomp.model.statics.description import Actuator, Chain, Element, Parallelogram, Robot, Transform

LENGTH_STEP_MM = 0.1  # of differences: linear within 1e-4 for links of 100 mm and more


def place_of(robot: Robot, actuator: str) -> tuple[Chain, int]:
    """The chain that holds the actuator, and the actuator's index among the chain's elements."""
    for chain in robot.chains:
        for k, each in enumerate(chain.elements):
            if isinstance(each, Actuator) and each.name == actuator:
                return chain, k
    raise KeyError(actuator)


def link_of(robot: Robot, actuator: str) -> tuple[Chain, int] | None:
    """Chain and index of the first arm or rigid step behind an actuator; None if the next element is an actuator."""
    chain, k = place_of(robot, actuator)
    for i in range(k + 1, len(chain.elements)):
        each = chain.elements[i]
        if isinstance(each, Actuator):
            return None
        if isinstance(each, Parallelogram) or (isinstance(each, Transform) and np.linalg.norm(each.translation) > 0.0):
            return chain, i
    return None


def lengthened(robot: Robot, actuator: str, length_mm: float) -> Robot:
    """Copy of a machine with a longer link behind an actuator; the machine itself if it has no such link."""
    found = link_of(robot, actuator)
    if found is None:
        return robot
    chain, i = found
    elements = (*chain.elements[:i], _longer(chain.elements[i], length_mm), *chain.elements[i + 1 :])
    return robot.edit_chain(chain.name, elements=elements)


def _longer(each: Element, length: float) -> Element:
    if isinstance(each, Parallelogram):
        step = float(np.linalg.norm(each.arm))
        return replace(each, arm=each.arm * ((step + length) / step))
    assert isinstance(each, Transform)
    step = float(np.linalg.norm(each.translation))
    return replace(each, translation=each.translation * ((step + length) / step))
