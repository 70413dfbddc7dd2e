"""The encoder swings past its set-point when the set-point's speed changes: a second-order loop with velocity feed-forward.

Its natural frequency is 1000 / period_ms Hz. A plain second-order loop, which is late besides by damping period / pi, is this
and a servo_lag of that time; with high damping servo_lag alone.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import least_squares

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter
from camcomp.model.hysteresis import first_order, inverse_second_order, second_order
from camcomp.model.seams import Seams

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


_PERIODS_S = tuple(np.geomspace(0.004, 0.25, 16))  # of loops that are tried first
_LEAST_LAG_S = 1e-5  # of a loop that is not late
_DAMPINGS = (0.1, 0.25, 0.5, 0.8, 1.5)
GUESSED_FROM = len(_PERIODS_S) * len(_DAMPINGS)


def guess(runs: Sequence[tuple[Floats, Floats, Floats]], hinge: bool) -> dict[str, float]:
    """Loop of logs of one axis by least squares, jointly with a first-order lag, a constant, friction and the weight of a hinge;
    empty where the axis rests or no loop of a feed drive is like it.

    runs: time (n,) s, set-points (n,), encoders (n,), NaN at instants between rows.
    """
    runs = [run for run in runs if len(run[0]) > 4 and np.ptp(run[1]) > 0.0]
    if not runs:
        return {}
    read = np.isfinite(np.concatenate([y for _, _, y in runs]))
    gap = np.concatenate([x - y for _, x, y in runs])[read]
    beside = np.concatenate([_beside(t, x, hinge) for t, x, _ in runs])[read]
    Q = np.linalg.qr(beside)[0]
    lagged = max(float(np.linalg.lstsq(beside, gap, rcond=None)[0][1]), _LEAST_LAG_S)

    begun = [Seams(np.zeros(1, int), np.full(1, np.inf), np.diff(x[:2])[:, None] / (t[1] - t[0])) for t, x, _ in runs]

    def left(at: Floats) -> Floats:
        period, damping, lag = np.exp(at).tolist()
        swung = [x[:, None] + second_order(x[:, None], t, period, damping) for t, x, _ in runs]
        late = [first_order(each, t, lag, seams) for each, (t, _, _), seams in zip(swung, runs, begun, strict=True)]
        swings = np.concatenate([x - each[:, 0] for (_, x, _), each in zip(runs, late, strict=True)])
        rest = gap - swings[read]
        return np.asarray(rest - Q @ (Q.T @ rest))

    grid = [np.log([period, damping, lagged]) for period in _PERIODS_S for damping in _DAMPINGS]
    first = min(grid, key=lambda at: float(np.sum(left(at) ** 2)))
    widest = np.log([(0.5 * _PERIODS_S[0], 0.01, 0.1 * _LEAST_LAG_S), (1.0, 10.0, 1.0)])
    period, damping, _ = np.exp(least_squares(left, first, bounds=widest, diff_step=1e-3, max_nfev=20).x).tolist()
    found = {"by_acceleration_ms2": (1e3 * period / (2.0 * np.pi)) ** 2, "damping": damping}
    return found if all(p.low < found[p.name] < p.high for p in FITTED) else {}


def _beside(time: Floats, place: Floats, hinge: bool) -> Floats:
    """What else a following error may hold (n, q): a constant, speed, friction, weight."""
    speed = np.gradient(place, time)
    weight = (np.sin(place), np.cos(place)) if hinge else ()
    return np.stack([np.ones(len(time)), speed, np.sign(speed), *weight], axis=1)


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


def invert_servo(position: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Set-points (n, m) with encoders at `position`."""
    period = p["period_ms"] * 1e-3
    if period == 0.0 or not motion.ordered:
        return position
    aimed = which > 0
    out = position.copy()
    out[:, aimed] = inverse_second_order(position[:, aimed], motion.time, period, p["damping"])
    return out
