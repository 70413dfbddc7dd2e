"""The encoder follows its set-point as a first-order lag: tau d(encoder)/dt = set-point - encoder.

A negative time constant is a lead: the encoder is where the set-point will be, as where set-points are logged late.
"""

from collections.abc import Mapping

import numpy as np

from camcomp.ground.datatypes import Bools, Floats
from camcomp.model.effect import Motion, Parameter
from camcomp.model.hysteresis import first_order, inverse_first_order

STAGE = "control"
TARGET = "either"
STAYS_BEHIND = True
PLAIN = "lag of the position loop"
REMEDY = (
    "raise the gain of the position loop (kv) or switch feed-forward on, the same on all axes; or cut more slowly; "
    "below 0 ms: log set-points and encoders of one instant, or lower the feed-forward"
)
SOURCE = "first-order position loop, tau = 1/kv (Gross, Hamann, Wiegaertner: Electrical feed drives in automation)"
_KV = "loop gains kv of 100 to 2000 1/s"
FITTED = (Parameter("time_constant_ms", "ms", 0.0, 0.0, 500.0, 3.0, 0.005, _KV, sign=1),)
# In logs of axes whose encoders are ahead of their set-points by half a row or more.
FITTED_AHEAD = (Parameter("time_constant_ms", "ms", 0.0, -500.0, 500.0, 3.0, 0.005, "set-points logged late"),)
PARAMETERS = (
    Parameter("time_constant_ms", "ms", 0.0, -500.0, 500.0, 3.0, 0.005, f"{_KV}; joints of arms up to 200 ms"),
)


def on_servo(position: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Encoder positions (n, m); the lag starts settled, at the speed at which a recording begins; a lead goes on at that of its end."""
    tau = p["time_constant_ms"] * 1e-3
    if tau == 0.0 or not motion.ordered:
        return position
    aimed = which > 0
    if tau < 0.0:
        return _led(position, motion, aimed, -tau)
    out = position.copy()
    seams = None if motion.seams is None else motion.seams.of(aimed)
    out[:, aimed] = first_order(position[:, aimed], motion.time, tau, seams)
    return out


def invert_servo(position: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Set-points (n, m) with encoders at `position`; behind a lead up to what set-points do between two instants."""
    tau = p["time_constant_ms"] * 1e-3
    if tau == 0.0 or not motion.ordered:
        return position
    aimed = which > 0
    if tau < 0.0:
        return _led(position, motion, aimed, tau)
    out = position.copy()
    out[:, aimed] = inverse_first_order(position[:, aimed], motion.time, tau)
    return out


def _led(position: Floats, motion: Motion, aimed: Bools, lead: float) -> Floats:
    """Copy of positions (n, m) with those aimed at where they will be `lead` s later; behind the end at the last speed."""
    out = position.copy()
    ahead = motion.time + lead
    beyond = np.maximum(ahead - motion.time[-1], 0.0)
    for j in np.flatnonzero(aimed.any(axis=0) if aimed.ndim > 1 else aimed):
        out[:, j] = np.interp(ahead, motion.time, position[:, j]) + beyond * motion.speed[-1, j]
    return out
