"""A link of an arm is not what its table says: the next joint (or the platform) sits elsewhere, and its axis leans.

Five numbers per link. The sixth, a turn about the next joint's own axis, is that joint's offset and has its own effect.
"""

from collections.abc import Mapping

import numpy as np

from camcomp.model.effect import Parameter
from camcomp.model.statics.description import Actuator, Robot, Transform
from camcomp.model.statics.lengths import place_of
from camcomp.model.statics.rotation import exp_rotation

STAGE = "structure"
GEOMETRY = True
TARGET = "actuator"
PLAIN = "a link other than its table says"
REMEDY = "keep the found geometry in the machine file, or in the robot's own calibration"
ARM_ONLY = True
SOURCE = (
    "link errors of robot calibration in the frame of the next joint: Hayati, Mirmirani, J. Robotic Systems 2 (1985) 397; "
    "complete with redundant parameters, which priors keep small"
)
_SHIFT, _TILT = "links of industrial arms are made and calibrated to 0.1 to 1 mm", "axes are square to 0.1 to 1 mrad"
PARAMETERS = (
    Parameter("x_mm", "mm", 0.0, -20.0, 20.0, 0.5, 0.01, _SHIFT),
    Parameter("y_mm", "mm", 0.0, -20.0, 20.0, 0.5, 0.01, _SHIFT),
    Parameter("z_mm", "mm", 0.0, -20.0, 20.0, 0.5, 0.01, _SHIFT),
    Parameter("tilt_x_deg", "deg", 0.0, -5.0, 5.0, 0.03, 0.0005, _TILT),
    Parameter("tilt_y_deg", "deg", 0.0, -5.0, 5.0, 0.03, 0.0005, _TILT),
)


def on_robot(robot: Robot, actuators: tuple[str, ...], p: Mapping[str, float]) -> Robot:
    """Copy of the arm in which what follows the links of these actuators is shifted and tilted.

    Axes are those of the frame in front of the next joint (behind the last joint: of the platform's elements), with z
    along that joint where its axis is z.
    """
    shift = np.array([p["x_mm"], p["y_mm"], p["z_mm"]])
    tilt = np.radians([p["tilt_x_deg"], p["tilt_y_deg"], 0.0])
    if not shift.any() and not tilt.any():
        return robot
    error = Transform(shift, exp_rotation(tilt))
    for name in actuators:
        chain, k = place_of(robot, name)
        end = next(
            (i for i in range(k + 1, len(chain.elements)) if isinstance(chain.elements[i], Actuator)),
            len(chain.elements),
        )
        robot = robot.edit_chain(chain.name, elements=(*chain.elements[:end], error, *chain.elements[end:]))
    return robot
