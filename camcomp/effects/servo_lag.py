"""The encoder follows its set-point as a first-order lag: tau d(encoder)/dt = set-point - encoder."""

from collections.abc import Mapping

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter
from camcomp.model.hysteresis import first_order

STAGE = "control"
TARGET = "either"
PLAIN = "lag of the position loop"
REMEDY = "raise the gain of the position loop (kv) or switch feed-forward on, alike on all axes; or cut more slowly"
SOURCE = "first-order position loop, tau = 1/kv (Gross, Hamann, Wiegaertner: Electrical feed drives in automation)"
PARAMETERS = (
    Parameter("time_constant_ms", "ms", 0.0, 0.0, 100.0, 3.0, 0.005, "loop gains kv of 100 to 2000 1/s", sign=1),
)


def on_servo(position: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Encoder positions (n, m); the lag starts settled, at the speed at which a recording begins."""
    tau = p["time_constant_ms"] * 1e-3
    if tau == 0.0 or not motion.ordered:
        return position
    aimed = which > 0
    out = position.copy()
    seams = None if motion.seams is None else motion.seams.of(aimed)
    out[:, aimed] = first_order(position[:, aimed], motion.time, tau, seams)
    return out
