"""Weight that the model leaves out: it pulls at the platform reference point, along machine -z."""

from collections.abc import Mapping

import numpy as np

from camcomp.model.effect import Load, Motion, Parameter

STAGE = "structure"
TARGET = "machine"
PLAIN = "weight that the model leaves out"
REMEDY = "weigh what hangs at the platform (spindle, hoses, gripper) and state it in the machine file"
SOURCE = "definition"
PARAMETERS = (
    Parameter("weight_N", "N", 0.0, 0.0, 5000.0, 30.0, 0.1, "spindles and platforms of 0.5 to 10 kg", sign=1),
)


def on_load(load: Load, motion: Motion, p: Mapping[str, float]) -> Load:
    """The load with the weight added to the wrench at the reference point."""
    weight = p["weight_N"]
    if weight == 0.0:
        return load
    return Load(load.force, load.wrench - weight * np.eye(6)[2])
