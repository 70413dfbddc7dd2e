"""The cutting force grows with the time that the tool has cut; air moves and pauses do not wear it."""

from collections.abc import Mapping

from camcomp.model.effect import Load, Motion, Parameter

STAGE = "process"
TARGET = "machine"
MODELLED_FORCE = True
PLAIN = "a tool that wears"
REMEDY = "change the tool earlier, or halve its time in the cut; the force grows while it cuts"
SOURCE = "linear middle part of the wear curve (ISO 8688-2)"
PARAMETERS = (
    Parameter("growth_per_min", "1/min", 0.0, 0.0, 20.0, 0.2, 0.0005, "tool lives of 5 to 60 minutes", sign=1),
    Parameter(
        "one_tool",
        "1",
        1.0,
        0.0,
        1.0,
        1.0,
        0.0,
        "1: the same tool in all runs; 0: a new one in each",
        either=(1.0, 0.0),
    ),
)


def on_load(load: Load, motion: Motion, p: Mapping[str, float]) -> Load:
    """The load with the cutting force grown by the minutes that the tool has cut so far."""
    growth = p["growth_per_min"]
    if growth == 0.0:
        return load
    cut = motion.cut_min - (1.0 - p.get("one_tool", 1.0)) * motion.cut_before_min
    return Load(load.force * (1.0 + growth * cut)[:, None], load.wrench)
