"""What remembers: lag, play and the direction of travel, as sweeps over ordered instants."""

import numpy as np
from numba import njit

from camcomp.datatypes import Floats

PRESLIDING_MM = 0.005  # rolling guides take 1 to 20 um to turn their friction round (Armstrong-Helouvry 1994)


@njit(cache=True)
def _first_order(x, t, tau):  # type: ignore[no-untyped-def]  # pragma: no cover
    y = np.empty_like(x)
    y[0] = x[0]
    for i in range(1, x.shape[0]):
        dt = t[i] - t[i - 1]
        decay = np.exp(-dt / tau)
        hold = tau * (1.0 - decay) / dt if dt > 0.0 else 1.0
        for j in range(x.shape[1]):
            # exact for a set-point that moves linearly between two instants
            y[i, j] = decay * y[i - 1, j] + (hold - decay) * x[i - 1, j] + (1.0 - hold) * x[i, j]
    return y


def first_order(x: Floats, time: Floats, tau: float) -> Floats:
    """First-order lag of x (n, m) with time constant tau s, settled at the start; time (n,) s, not decreasing."""
    return _first_order(np.ascontiguousarray(x), np.ascontiguousarray(time), tau)


@njit(cache=True)
def _play(x, width):  # type: ignore[no-untyped-def]  # pragma: no cover
    y = np.empty_like(x)
    for j in range(x.shape[1]):
        state = x[0, j]
        for i in range(x.shape[0]):
            state = min(max(state, x[i, j] - 0.5 * width), x[i, j] + 0.5 * width)
            y[i, j] = state - x[i, j]
    return y


def play(x: Floats, width: float) -> Floats:
    """Carriage minus encoder (n, m) of a play of full `width` mm driven by x (n, m), centred at the start."""
    return _play(np.ascontiguousarray(x), width)


@njit(cache=True)
def _direction(x, distance):  # type: ignore[no-untyped-def]  # pragma: no cover
    y = np.zeros_like(x)
    for j in range(x.shape[1]):
        state = 0.0
        for i in range(1, x.shape[0]):
            step = x[i, j] - x[i - 1, j]
            sign = 1.0 if step > 0.0 else -1.0
            if step != 0.0:
                state = sign + (state - sign) * np.exp(-abs(step) / distance)
            y[i, j] = state
    return y


def direction(x: Floats, distance: float = PRESLIDING_MM) -> Floats:
    """Sign of travel with memory (n, m): Dahl's law turns it round over `distance`; 0 before the first move.

    Source: Dahl 1968 with exponent 1. Holds while: rate-independent friction.
    """
    return _direction(np.ascontiguousarray(x), distance)
