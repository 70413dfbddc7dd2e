"""What happens in time between set-point and carriage: servo, play, sliding friction, heat.

Each is deliberately another formula than the usual fit model: a second-order servo where a fit takes a first-order lag, a
play operator with memory where a fit takes the sign of the speed, Maxwell slip blocks where a fit takes a Coulomb step, two
coupled heat stores where a fit takes one exponential.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.linalg import expm
from scipy.signal import lfilter

STEP = 1e-3  # s, grid of the time-domain parts


def servo_error(setpoint: np.ndarray, lag_ms: float, damping: float) -> np.ndarray:
    """Encoder minus set-point (n,) of a second-order servo whose constant-speed delay is lag_ms.

    x'' = w²(c - x) - 2 z w x' follows a ramp late by 2 z / w.  Exact for set-points that are straight between samples.
    """
    if lag_ms == 0.0:
        return np.zeros_like(setpoint)
    w = 2 * damping / (lag_ms * 1e-3)
    # e = x - c obeys e'' + 2zw e' + w² e = -c'' - 2zw c'; with v = c' constant inside a step and y = e' + v continuous,
    # state (x - c, x') is advanced exactly by the matrix exponential of the augmented system.
    block = np.zeros((3, 3))
    block[0, 1], block[1, 0], block[1, 1] = 1.0, -w * w, -2 * damping * w
    block[0, 2] = -1.0  # e' = x' - v
    m = expm(block * STEP)
    v = np.diff(setpoint) / STEP
    # second-order recursion for e: e[n+1] = tr e[n] - det e[n-1] + b0 v[n] + b1 v[n-1]
    trace, det = m[0, 0] + m[1, 1], m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
    b0, b1 = m[0, 2], m[0, 1] * m[1, 2] - m[1, 1] * m[0, 2]
    e = lfilter([b0, b1], [1.0, -trace, det], v)
    return np.concatenate([[0.0], e])


@njit(cache=True)
def play(x: np.ndarray, width: float, start: float) -> np.ndarray:
    """Position (n,) of a body carried by x through a gap of full width `width`; start: -1..1, its place in the gap."""
    half = 0.5 * width
    y = np.empty_like(x)
    now = x[0] + start * half
    for i in range(len(x)):
        now = min(max(now, x[i] - half), x[i] + half)
        y[i] = now
    return y


@njit(cache=True)
def slip_blocks(x: np.ndarray, limit: float, slip_mm: float, spring: float) -> np.ndarray:
    """Friction force (n,) N, positive when it holds back motion along +, on a carriage pulled through a spring by x.

    Four Maxwell blocks in parallel share the Coulomb force `limit`; they let go at 0.1, 0.3, 0.6 and 1 of slip_mm.  The
    carriage is where the spring (N/mm) leaves it: x - f/spring.
    """
    share = limit * np.array([0.15, 0.25, 0.3, 0.3])
    stiff = share / (slip_mm * np.array([0.1, 0.3, 0.6, 1.0]))
    held = np.zeros(4)
    out = np.empty_like(x)
    carriage = x[0]
    for i in range(len(x)):
        low, high = -limit, limit
        for _ in range(26):
            f = 0.5 * (low + high)
            total = 0.0
            for j in range(4):
                total += min(max(held[j] + stiff[j] * (x[i] - f / spring - carriage), -share[j]), share[j])
            if total > f:
                low = f
            else:
                high = f
        f = 0.5 * (low + high)
        new = x[i] - f / spring
        for j in range(4):
            held[j] = min(max(held[j] + stiff[j] * (new - carriage), -share[j]), share[j])
        carriage = new
        out[i] = f
    return out


@njit(cache=True)
def _stores(on: np.ndarray, rest: float, work: float, fast: float, slow: float) -> np.ndarray:
    out = np.zeros((len(on), 2))
    for i in range(1, len(on)):
        screw, frame = out[i - 1]
        out[i, 0] = screw + (rest + work * on[i - 1] - (screw - frame)) / fast
        out[i, 1] = frame + (0.6 * (screw - frame) - frame) / slow
    return out


def warming(t: np.ndarray, busy: list[tuple[float, float]], rise: tuple[float, float], taus: tuple[float, float]):
    """Temperatures above ambient (n, 2) K of screw and frame at common times t (n,), heated in the busy intervals.

    Two stores in a row: the screw (fast) gives its heat to the frame (slow), the frame to the room.  rise: steady rise of
    the screw over the frame at rest, and what work adds, K; taus: the two time constants, s.  Steps of one second.
    """
    grid = np.arange(0.0, max(float(np.max(t)), 0.0) + 3.0, 1.0)
    on = np.zeros(len(grid))
    for a, b in busy:
        on[(grid >= a) & (grid < b)] = 1.0
    out = _stores(on, rise[0], rise[1], taus[0], taus[1])
    return np.stack([np.interp(t, grid, out[:, 0]), np.interp(t, grid, out[:, 1])], 1)
