"""The encoder swings past its set-point when the set-point's speed changes: a second-order loop with velocity feed-forward.

Its natural frequency is 1000 / period_ms Hz. A plain second-order loop, which is late besides by damping period / pi, is this
and a servo_lag of that time; with high damping servo_lag alone.
"""

from collections.abc import Mapping

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter
from camcomp.model.hysteresis import second_order

STAGE = "control"
TARGET = "either"
PLAIN = "a position loop that overshoots"
REMEDY = "lower the loop gain or raise its damping, add acceleration feed-forward, or limit acceleration and jerk"
SOURCE = (
    "x'' + 2 d w (x' - c') + w^2 (x - c) = 0, set-point c, w = 2 pi / period (Gross, Hamann, Wiegaertner: Electrical feed "
    "drives in automation)"
)
_LOOPS = "position loops of feed drives: 5 to 60 Hz"
_DAMPING = Parameter(
    "damping", "1", 0.7, 0.02, 5.0, 0.2, 0.0, "loops as they are tuned: 0.3 to 1", scan=(0.1, 0.2, 0.4, 0.7, 1.2)
)
PARAMETERS = (
    Parameter("period_ms", "ms", 0.0, 0.0, 600.0, 40.0, 1.0, _LOOPS, sign=1),
    _DAMPING,
)
# What shows first is the set-point's acceleration times the square of period / 2 pi.
FITTED = (
    Parameter("by_acceleration_ms2", "ms2", 0.0, 0.0, 9000.0, 40.0, 0.1, _LOOPS, sign=1),
    _DAMPING,
)


def public(fitted: Mapping[str, float]) -> dict[str, float]:
    """Period and damping from the fitted parameters."""
    period = 2.0 * np.pi * float(np.sqrt(max(fitted["by_acceleration_ms2"], 0.0)))
    return {"period_ms": period, "damping": fitted["damping"]}


def on_servo(position: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Encoder positions (n, m); the loop starts settled."""
    period = p["period_ms"] * 1e-3
    if period == 0.0 or not motion.ordered:
        return position
    aimed = which > 0
    out = position.copy()
    out[:, aimed] += second_order(position[:, aimed], motion.time, period, p["damping"])
    return out
