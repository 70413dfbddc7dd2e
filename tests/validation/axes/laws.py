"""Columns of the contract's effects on encoders and drive forces, and the residual of their fit. Nothing of the plant."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import cont2discrete, lfilter

from tests.validation.axes.motion import STEP_S
from tests.validation.axes.plant import bristles

Array = np.ndarray
LAGS_S = (0.5e-3, 2e-3, 5e-3, 12e-3, 30e-3)
SWINGS = ((0.01, 0.3), (0.025, 0.3), (0.025, 1.0), (0.06, 0.3), (0.06, 1.0))  # period s, damping
REACHES = (1e-3, 4e-3, 15e-3, 60e-3)
CONTROL = (("servo_lag",), ("servo_overshoot",), ("servo_lag", "servo_overshoot"))


def rms(values: Array) -> float:
    """Of all values."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0


def passed(command: Array, above: list[float], below: list[float]) -> Array:
    """Output of a transfer function for set-points that are straight between their samples."""
    b, a, _ = cont2discrete((above, below), STEP_S, method="foh")
    return command[0] + lfilter(np.ravel(b), np.ravel(a), command - command[0])


def lagged(command: Array, seconds: float) -> Array:
    """First-order lag."""
    return passed(command, [1.0], [seconds, 1.0])


def swung(command: Array, period_s: float, damping: float) -> Array:
    """Second-order loop whose set-point's speed is fed forward."""
    w = 2 * np.pi / period_s
    return passed(command, [2 * damping * w, w * w], [1.0, 2 * damping * w, w * w])


def control(effects: tuple[str, ...], p: Array, command: Array) -> Array:
    """Encoder behind effects of the control; p: logarithms of lag, and of period and damping."""
    values, out = list(np.exp(p)), command
    if "servo_lag" in effects:
        out = lagged(out, values.pop(0))
    if "servo_overshoot" in effects:
        out = swung(out, *values)
    return out


def control_left(effects: tuple[str, ...], commands: list[Array], errors: list[Array], rows: list[Array]) -> float:
    """Rms (mm) of following errors that the best values of these effects, and a constant per run, leave at the rows."""
    picks = [at[:: max(1, len(at) // 800)] for at in rows]

    def rest(p: Array) -> Array:
        out = []
        for command, error, at in zip(commands, errors, picks, strict=True):
            values = (error - (control(effects, p, command) - command if effects else 0.0))[at]
            out.append(values - values.mean())
        return np.concatenate(out)

    if not effects:
        return rms(rest(np.zeros(0)))
    best = np.inf
    lags = [np.log(s) for s in (0.1e-3, 1e-3, 6e-3)] if "servo_lag" in effects else [None]
    swings = [np.log([s, 0.5]) for s in (0.008, 0.03, 0.1)] if "servo_overshoot" in effects else [None]
    starts = [np.concatenate([np.atleast_1d(x) for x in (a, b) if x is not None]) for a in lags for b in swings]
    low = ([np.log(1e-6)] if "servo_lag" in effects else []) + (
        [np.log([0.002, 0.02])] if swings[0] is not None else []
    )
    high = ([np.log(0.1)] if "servo_lag" in effects else []) + ([np.log([0.6, 5.0])] if swings[0] is not None else [])
    bounds = (np.concatenate([np.atleast_1d(x) for x in low]), np.concatenate([np.atleast_1d(x) for x in high]))
    starts = sorted(starts, key=lambda p: rms(rest(p)))[:1]
    for start in starts:
        scale = max(rms(rest(start)), 1e-9)
        fit = least_squares(lambda p, s=scale: rest(p) / s, start, bounds=bounds, max_nfev=25)
        best = min(best, rms(rest(fit.x)))
    return best


def control_span_left(commands: list[Array], errors: list[Array], rows: list[Array], sense: bool = False) -> float:
    """The same by a linear fit of many lags and swings at once: more than the library can do. sense: friction, too."""
    parts = []
    for number, (command, at) in enumerate(zip(commands, rows, strict=True)):
        columns = [lagged(command, s) - command for s in LAGS_S] + [swung(command, *s) - command for s in SWINGS]
        speed = np.gradient(command, STEP_S)
        columns += [speed, np.gradient(speed, STEP_S)]
        if sense:
            columns += [bristles(command, reach, 1e6) for reach in REACHES]
        block = np.column_stack([column[at] for column in columns])
        ones = np.zeros((len(at), len(commands)))
        ones[:, number] = 1
        parts.append(np.column_stack([block, ones]))
    return _left(np.concatenate(parts), np.concatenate([e[at] for e, at in zip(errors, rows, strict=True)]))


def force_left(
    motors: list[Array], forces: list[Array], rows: list[Array], coarse: bool = False, friction: bool = True
) -> float:
    """Rms (N) of drive forces that friction, mass and a constant per run leave; coarse: the mass as the rows show it."""
    parts, target = [], []
    for number, (motor, force, at) in enumerate(zip(motors, forces, rows, strict=True)):
        speed = np.gradient(motor, STEP_S)
        change = np.gradient(speed, STEP_S)
        if coarse:
            change = np.interp(np.arange(len(motor)), at, np.gradient(np.gradient(motor[at], at * STEP_S), at * STEP_S))
        columns = [change]
        if friction:
            columns += [bristles(motor, reach, 1e3) for reach in REACHES] + [speed, np.abs(speed)]
        ones = np.zeros((len(at), len(motors)))
        ones[:, number] = 1
        parts.append(np.column_stack([*(column[at] for column in columns), ones]))
        target.append(force[at])
    return _left(np.concatenate(parts), np.concatenate(target))


def _left(matrix: Array, target: Array) -> float:
    size = np.linalg.norm(matrix, axis=0)
    matrix = matrix[:, size > 0] / size[size > 0]
    fit, *_ = np.linalg.lstsq(matrix, target, rcond=1e-7)
    return rms(target - matrix @ fit)
