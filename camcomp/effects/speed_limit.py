"""The drive has a largest speed: an encoder whose set-point moves faster falls behind, and catches up at that speed.

Servos behind a bus begin later than they are told: the dead time delays the set-point in front of the limit.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import minimize

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter
from camcomp.model.hysteresis import first_order, rate_limited

STAGE = "control"
TARGET = "actuator"
UNCORRECTABLE = True  # no set-point makes a drive faster
PLAIN = "a drive that goes no faster"
REMEDY = "program a lower feed or rapid, raise the speed limit of the drive, or look for what brakes it"
SOURCE = "rate limiter: |d(encoder)/dt| at most the speed, on the set-point where that allows it (Franklin et al., Feedback Control)"
NO_LIMIT = 1e6
_SHARES = np.linspace(0.3, 1.2, 24)  # of the fastest encoder, that are looked at as limits
_DEAD_TIMES_S = np.linspace(0.0, 0.3, 11)
GUESSED_FROM = len(_SHARES) * len(_DEAD_TIMES_S)
_SHARE = Parameter("share", "1", 1.0, 0.0, 1.0, 1.0, 0.01, "of what the limit holds back: 1 by definition", sign=1)
_SOURCE = "feed drives: 0.1 to 1 m/s; axes of arms: 0.2 to 10 rad/s"
PARAMETERS = (
    Parameter("speed_mm_per_s", "mm/s", NO_LIMIT, 1e-3, NO_LIMIT, 100.0, 0.1, _SOURCE),
    Parameter("speed_rad_per_s", "rad/s", NO_LIMIT, 1e-6, NO_LIMIT, 1.0, 0.001, _SOURCE),
    _SHARE,
    Parameter("dead_time_ms", "ms", 0.0, 0.0, 1000.0, 20.0, 0.1, "buses of servos: 1 to 200 ms"),
)
_SPEEDS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)
_ABSENT = Parameter("share", "1", 0.0, 0.0, 1.0, 1.0, 0.01, _SHARE.source, sign=1)
FITTED = (
    _ABSENT,
    Parameter("speed_mm_per_s", "mm/s", 10.0, 1e-3, NO_LIMIT, 10.0, 0.0, _SOURCE, scan=_SPEEDS),
)
ROTARY = (
    _ABSENT,
    Parameter("speed_rad_per_s", "rad/s", 0.1, 1e-6, NO_LIMIT, 0.1, 0.0, _SOURCE, scan=tuple(0.01 * each for each in _SPEEDS)),
)  # fmt: skip


def first_guess(runs: Sequence[tuple[Floats, Floats, Floats]]) -> float:
    """The largest speed, per s, that best explains the following error of encoders; NO_LIMIT if every limit is worse.

    runs: time (n,) s, set-points (n,), encoders (n,) of one actuator.
    """
    runs = [run for run in runs if len(run[0]) > 1 and np.ptp(run[0]) > 0.0]
    fastest = _fastest([(t, x) for t, x, _ in runs])
    if fastest == 0.0:
        return NO_LIMIT
    shares = np.geomspace(0.02, 1.0, 80)
    best = int(np.argmin([_left(runs, share * fastest) for share in shares]))
    near = np.geomspace(shares[max(best - 1, 0)], shares[min(best + 1, len(shares) - 1)], 41)
    speed = fastest * float(near[np.argmin([_left(runs, share * fastest) for share in near])])
    return speed if _left(runs, speed) < _left(runs, NO_LIMIT) else NO_LIMIT


def guess(runs: Sequence[tuple[Floats, Floats, Floats]], hinge: bool) -> dict[str, float]:
    """Largest speed and dead time of logs of one axis by least squares; empty where a dead time or a lag alone explains as much.

    runs: as in `first_guess`; encoders NaN at instants between rows.
    """
    runs = [run for run in runs if len(run[0]) > 1 and np.ptp(run[0]) > 0.0]
    read = [np.isfinite(y) for _, _, y in runs]
    fastest = _fastest([(t[on], y[on]) for (t, _, y), on in zip(runs, read, strict=True)])
    if fastest == 0.0:
        return {}
    first = min(
        ((speed, dead) for speed in fastest * _SHARES for dead in _DEAD_TIMES_S), key=lambda at: _left(runs, *at)
    )
    at = minimize(lambda x: _left(runs, *np.abs(x)), first, method="Nelder-Mead", options={"maxiter": 60}).x
    speed, dead = (abs(float(each)) for each in at)
    others = [_left(runs, NO_LIMIT, each) for each in (*_DEAD_TIMES_S, dead)]
    others += [_left_by_lag(runs, each) for each in (*_DEAD_TIMES_S[1:], max(dead, 1e-6))]
    if min(others) <= _left(runs, speed, dead):
        return {}
    return {"speed_rad_per_s" if hinge else "speed_mm_per_s": speed, "dead_time_ms": 1e3 * dead}


def _fastest(runs: Sequence[tuple[Floats, Floats]]) -> float:
    return max(
        (float(np.abs(np.diff(x) / np.maximum(np.diff(t), 1e-9)).max(initial=0.0)) for t, x in runs), default=0.0
    )


def _left(runs: Sequence[tuple[Floats, Floats, Floats]], speed: float, dead: float = 0.0) -> float:
    """Sum of squares that a limit leaves of the encoders."""
    return sum(
        float(np.nansum((y - rate_limited(_delayed(x[:, None], t, dead), t, speed)[:, 0]) ** 2)) for t, x, y in runs
    )


def _left_by_lag(runs: Sequence[tuple[Floats, Floats, Floats]], constant: float) -> float:
    """Sum of squares that a first-order lag leaves of the encoders."""
    return sum(float(np.nansum((y - first_order(x[:, None], t, constant)[:, 0]) ** 2)) for t, x, y in runs)


def on_servo(position: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Encoder positions (n, m); on the set-points at the start."""
    speed = min(p.get("speed_mm_per_s", NO_LIMIT), p.get("speed_rad_per_s", NO_LIMIT))
    share = p.get("share", 1.0)
    if speed >= NO_LIMIT or share == 0.0 or not motion.ordered:
        return position
    aimed = which > 0
    asked = position[:, aimed]
    out = position.copy()
    limited = rate_limited(_delayed(asked, motion.time, 1e-3 * p.get("dead_time_ms", 0.0)), motion.time, speed)
    out[:, aimed] = asked + share * (limited - asked)
    return out


def _delayed(position: Floats, time: Floats, by: float) -> Floats:
    """Positions (n, m) of `by` s before."""
    return position if by == 0.0 else np.stack([np.interp(time - by, time, own) for own in position.T], axis=1)
