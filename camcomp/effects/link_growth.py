"""A link grows as it warms: its length follows the temperature above 20 deg C, or a warm-up where none is logged."""

from collections.abc import Mapping

from camcomp.effects._warmth import WARM_UP, warmth
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter
from camcomp.model.statics.description import Robot
from camcomp.model.statics.lengths import link_of

STAGE = "structure"
TARGET = "actuator"
PLAIN = "a link that grows with temperature"
REMEDY = (
    "warm the machine up before it works, keep heat away from the link, and keep the coefficient in the machine file"
)
SOURCE = "linear expansion along the link; first-order warm-up where no temperature is logged"
WARMS = True  # compensate asks for the machine's temperature
PARAMETERS = (
    Parameter("growth_mm_per_K", "mm/K", 0.0, -0.2, 0.2, 0.01, 0.00003, "steel and aluminium, 11.5e-6 and 23e-6 per K, 300 to 1200 mm"),
    WARM_UP,
)  # fmt: skip


def applies(robot: Robot, target: str | None) -> bool:
    """Whether a link stands behind a hinge: behind a slide its growth equals that of the drive (thermal_growth)."""
    hinges = {each.name for each in robot.actuators if each.revolute}
    return target in hinges and link_of(robot, target) is not None


def on_links(length: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Growth of the links behind the actuators (n, m), mm."""
    growth = p["growth_mm_per_K"]
    if growth == 0.0:
        return length
    return length + growth * warmth(motion, p["warm_up_s"])[:, None] * which
