"""The cutting force is a constant factor times the modelled one."""

from collections.abc import Mapping

from camcomp.model.effect import Load, Motion, Parameter

STAGE = "process"
TARGET = "machine"
MODELLED_FORCE = True
PLAIN = "a cutting force other than modelled"
REMEDY = (
    "cut two slots of different depth and let diagnose fit the force, and check material, tool and engagement "
    "under process"
)
SOURCE = "definition; scatter of specific cutting forces between batches (Altintas: Manufacturing automation)"
PARAMETERS = (
    Parameter("factor", "1", 1.0, 0.02, 20.0, 0.3, 0.002, "specific cutting forces are known to 10 to 50 %", log=True),
)


def on_load(load: Load, motion: Motion, p: Mapping[str, float]) -> Load:
    """The load with the cutting force scaled."""
    factor = p["factor"]
    return load if factor == 1.0 else Load(load.force * factor, load.wrench)
