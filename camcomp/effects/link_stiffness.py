"""All links (feet, bars) are softer or stiffer than stated, by one factor: material, wall, joints between them."""

from collections.abc import Mapping

from camcomp.ground.records import replace
from camcomp.model.effect import Parameter
from camcomp.model.statics.description import Link, Parallelogram, Robot

STAGE = "structure"
TARGET = "machine"
PLAIN = "links softer or stiffer than stated"
REMEDY = "check the joints of the legs for play and screws for torque, then keep the factor in the machine file"
SOURCE = "definition: one factor on every six-dof link spring"
PARAMETERS = (
    Parameter("factor", "1", 1.0, 0.02, 20.0, 0.4, 0.003, "beam theory leaves out joints: -50 .. +50 %", log=True),
)


def on_robot(robot: Robot, actuators: tuple[str, ...], p: Mapping[str, float]) -> Robot:
    """Copy of the machine with every link spring and every bar scaled."""
    factor = p["factor"]
    if factor == 1.0:
        return robot
    links = robot.edit(Link, lambda each: replace(each, stiffness=each.stiffness * factor))
    return links.edit(Parallelogram, lambda each: replace(each, bar_stiffness=each.bar_stiffness * factor))
