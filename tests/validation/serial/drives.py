"""What happens between set-point and carriage, step by step in time. Nothing here is shared with the contract.

Arrays are (n,) at the step of the recordings; mm or rad, N or N mm.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.linalg import expm
from scipy.signal import lfilter

STEP_S = 1e-3
SOFT_FLANKS = np.array([0.8, 0.9, 1.0, 1.1, 1.2])


def follow(command: np.ndarray, matrix: np.ndarray, entry: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Output row.x of x' = matrix x + entry command (two states), exact for a command straight between its samples."""
    big = np.zeros((4, 4))
    big[:2, :2], big[:2, 2], big[2, 3] = matrix * STEP_S, entry * STEP_S, 1.0
    both = expm(big)
    a, late = both[:2, :2], both[:2, 3]
    early = both[:2, 2] - late
    # row (z - a)^-1 (early + z late) as a ratio of polynomials in 1/z.
    trace, det = a[0, 0] + a[1, 1], np.linalg.det(a)
    adjoint = np.array([[a[1, 1], -a[0, 1]], [-a[1, 0], a[0, 0]]])
    first = row @ late
    second = row @ early - row @ adjoint @ late
    third = -row @ adjoint @ early
    rest = command[0]
    return rest + lfilter([first, second, third], [1.0, -trace, det], command - rest)


def servo(command: np.ndarray, lag_s: float) -> np.ndarray:
    """A position loop over a velocity loop ten times as fast; behind a ramp by lag_s times its speed."""
    if lag_s <= 0:
        return command
    outer, inner = 1 / lag_s, 10 / lag_s
    matrix = np.array([[0, 1], [-inner * outer, -inner]])
    return follow(command, matrix, np.array([0, inner * outer]), np.array([1.0, 0]))


def ringing(command: np.ndarray, hertz: float, damping: float) -> np.ndarray:
    """How far a weakly damped resonance swings off its command; without lag on a ramp."""
    w = 2 * np.pi * hertz
    matrix = np.array([[0, 1], [-w * w, -2 * damping * w]])
    return follow(command, matrix, np.array([0, w * w]), np.array([1.0, 2 * damping / w])) - command


def play(motor: np.ndarray, width: float) -> np.ndarray:
    """Carriage minus motor behind a play of this full width whose flanks give way a little."""
    out = np.zeros(len(motor))
    if width > 0:
        for share in SOFT_FLANKS:
            out += _play(motor, width * share / 2)
        out /= len(SOFT_FLANKS)
    return out


def follow_play(motor: np.ndarray, half: float) -> np.ndarray:
    """Carriage minus motor behind a hard play of half a width."""
    return _play(np.ascontiguousarray(motor), half)


@njit
def _play(motor: np.ndarray, half: float) -> np.ndarray:
    out = np.zeros(len(motor))
    gap = 0.0
    for k in range(1, len(motor)):
        gap -= motor[k] - motor[k - 1]
        gap = min(max(gap, -half), half)
        out[k] = gap
    return out


@njit
def bristles(motor: np.ndarray, presliding: float, slow: float) -> np.ndarray:
    """State of a guide's bristles over their yield force, LuGre without viscosity, some 5 % more below the speed slow.

    +1 while it slides in the positive direction: the guide then pushes against it.
    """
    out = np.zeros(len(motor))
    state = 0.0
    for k in range(1, len(motor)):
        step = motor[k] - motor[k - 1]
        if step != 0.0:
            level = 1 + 0.05 * np.exp(-((step / 1e-3 / slow) ** 2))
            end = level if step > 0 else -level
            state = end + (state - end) * np.exp(-abs(step) / (presliding * level))
        out[k] = state
    return out


@njit
def leak(rate: np.ndarray, seconds: float) -> np.ndarray:
    """Integral of a rate (per s) that leaks away within some seconds."""
    out = np.zeros(len(rate))
    for k in range(1, len(rate)):
        out[k] = out[k - 1] + 1e-3 * (rate[k] - out[k - 1] / seconds)
    return out
