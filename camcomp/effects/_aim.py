"""Where in a machine an effect with an actuator's name acts."""

from camcomp.model.statics.description import Actuator, Chain, Robot


def place(robot: Robot, actuator: str) -> tuple[Chain, int]:
    """The chain that holds the actuator, and the actuator's index among the chain's elements."""
    for chain in robot.chains:
        for k, each in enumerate(chain.elements):
            if isinstance(each, Actuator) and each.name == actuator:
                return chain, k
    raise KeyError(actuator)
