"""The clock of the tip measurement is off that of the controller."""

from collections.abc import Mapping

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Parameter

STAGE = "sensor"
TARGET = "machine"
PLAIN = "clocks of logger and control apart"
REMEDY = "trigger both from one signal; the machine itself needs no repair"
SOURCE = "definition: a row's tip is the one that the machine had offset_s earlier"
PARAMETERS = (Parameter("offset_s", "s", 0.0, -1.0, 1.0, 0.006, 0.000005, "unsynchronised loggers: 0.5 to 20 ms"),)


def on_clock(time: Floats, p: Mapping[str, float]) -> Floats:
    """Time (n,) s at which the tip stood where a row says."""
    offset = p["offset_s"]
    return time if offset == 0.0 else time - offset
