"""Textbook models of one axis: what least squares makes of set-point and encoder.

    act - cmd = -T cmd' + a cmd'' + c sign(cmd') + o + w1 sin(cmd) + w2 cos(cmd)        (the last two on hinges only)

lag T (negative: the encoder leads), acceleration a, Coulomb friction c, offset o, weight by angle w; or a first-order lag T act' = cmd - act; or a speed
limit.  Source: any textbook on identification of drives, e.g. Swevers, Verdonck, De Schutter, IEEE Control Systems 27 (2007).
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import savgol_filter

SET_POINT_ROWS = 5  # of the polynomial that differentiates set-points, which have no noise
MEASURED_S = 0.03  # the same of encoders
RIDGE = 1e-4  # of the largest column's energy


def _rate(values: np.ndarray, t: np.ndarray, order: int, rows: int = SET_POINT_ROWS) -> np.ndarray:
    return savgol_filter(values, rows, 3, deriv=order, delta=float(np.median(np.diff(t))))


def columns(t: np.ndarray, way: np.ndarray, hinge: bool, rows: int = SET_POINT_ROWS) -> np.ndarray:
    """Speed, acceleration, sign of the speed (softened near standstill), one; sine and cosine of the way on hinges: (n, 4 or 6)."""
    speed = _rate(way, t, 1, rows)
    creep = 0.02 * np.abs(speed).max()
    columns = [speed, _rate(way, t, 2, rows), np.tanh(speed / creep), np.ones_like(way)]
    return np.stack(columns + ([np.sin(way), np.cos(way)] if hinge else []), 1)


def least_squares(fit: tuple, judge: tuple, *, hinge: bool, ridge: float = 0.0) -> np.ndarray:
    """Residual (n,) of act on the judged run; fit and judge are (t, cmd, act)."""
    X, y = columns(fit[0], fit[1], hinge), fit[2] - fit[1]
    size = np.linalg.norm(X, axis=0) + 1e-15
    M = X / size
    c = np.linalg.solve(M.T @ M + (ridge + 1e-12) * np.eye(M.shape[1]), M.T @ y) / size
    return judge[2] - judge[1] - columns(judge[0], judge[1], hinge) @ c


def first_order_lag(fit: tuple, judge: tuple) -> np.ndarray:
    """Residual (n,) of act on the judged run behind one time constant and an offset."""

    def behind(run: tuple, constant: float) -> np.ndarray:
        t, cmd, _ = run
        out, value = np.empty_like(cmd), cmd[0]
        for i, share in enumerate(1.0 - np.exp(-np.diff(t, prepend=t[0]) / constant)):
            value += share * (cmd[i] - value)
            out[i] = value
        return out

    def misses(log_constant: float) -> float:
        return float(np.var(fit[2] - behind(fit, np.exp(log_constant))))

    constant = float(np.exp(minimize_scalar(misses, bounds=(np.log(1e-4), np.log(2.0)), method="bounded").x))
    return judge[2] - behind(judge, constant) - np.mean(fit[2] - behind(fit, constant))


def speed_limit(fit: tuple, judge: tuple) -> np.ndarray:
    """Residual (n,) of act on the judged run behind a largest speed and a dead time."""

    def behind(run: tuple, limit: float, dead: float) -> np.ndarray:
        t, cmd, act = run
        wanted = np.interp(t - dead, t, cmd)
        out, value = np.empty_like(cmd), act[0]
        for i, step in enumerate(np.diff(t, prepend=t[0])):
            value += float(np.clip(wanted[i] - value, -limit * step, limit * step))
            out[i] = value
        return out

    top = np.abs(np.diff(fit[2]) / np.diff(fit[0])).max()
    tries = [(limit, dead) for limit in top * np.linspace(0.5, 1.2, 71) for dead in np.linspace(0.0, 0.3, 13)]
    limit, dead = min(tries, key=lambda each: float(np.mean((fit[2] - behind(fit, *each)) ** 2)))
    return judge[2] - behind(judge, limit, dead)


def force_balance(fit: tuple, judge: tuple) -> np.ndarray:
    """Residual (n,) of the drive force: inertia, viscous and Coulomb friction, offset; tuples are (t, act, force)."""
    rows = 2 * round(0.5 * MEASURED_S / float(np.median(np.diff(fit[0])))) + 1
    X = columns(fit[0], fit[1], False, rows)
    size = np.linalg.norm(X, axis=0) + 1e-15
    c = np.linalg.lstsq(X / size, fit[2], rcond=None)[0] / size
    return judge[2] - columns(judge[0], judge[1], False, rows) @ c
