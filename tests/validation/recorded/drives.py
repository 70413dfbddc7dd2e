"""Dynamics between set-point and carriage on the recordings' grid of 1 ms: servo, friction, heat.

Play is `tests.validation.plants.drives.play`.  None of these formulas is the fit model's: two loops in cascade where a fit has one, LuGre's
bristles with Stribeck's bump where a fit has a Coulomb step that turns round, a warming of two parts where it has one.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.signal import cont2discrete, lfilter

STEP_S = 1e-3
PARTS = 8  # of a millisecond, in which the bristles are advanced


def servo(setpoint: np.ndarray, delay_ms: float, share: float) -> np.ndarray:
    """Encoder (n,) mm behind set-points (n,) mm: a position loop around a speed loop, late by delay_ms at constant speed.

    1 / (1 + T s + share T² s²), where share < 0.25 is the speed loop's time constant over the position loop's; exact for
    set-points that are straight between the samples.  At rest before the first sample.
    """
    if delay_ms <= 0.0:
        return setpoint
    slow = delay_ms * 1e-3
    above, below = [-share * slow**2, -slow, 0.0], [share * slow**2, slow, 1.0]
    b, a, _ = cont2discrete((above, below), STEP_S, method="foh")
    return setpoint + lfilter(b.ravel(), a, setpoint - setpoint[0])


@njit(cache=True)
def bristles(pulled: np.ndarray, limit: float, reach: float, spring: float, stribeck: float, slow: float) -> np.ndarray:
    """Friction (n,) N, positive against motion along +, of a carriage that a drive at `pulled` (n,) mm draws by a spring.

    LuGre without damping: z' = v - |v| z / g(v), friction = limit z / reach; at rest the bristles hold (1 + stribeck) limit,
    which speeds above `slow` mm/s wear down to limit.  spring N/mm, reach mm.
    """
    out = np.zeros(len(pulled))
    z, stiffness = 0.0, limit / reach
    for i in range(1, len(pulled)):
        step = (pulled[i] - pulled[i - 1]) / PARTS
        for _ in range(PARTS):
            way = 1.0 if step > 0 else -1.0
            speed = abs(step) * PARTS / STEP_S
            most = reach * (1.0 + stribeck * np.exp(-((speed / slow) ** 2)))
            give = 1.0 - way * z / most
            moved = step / (1.0 + stiffness / spring * give)  # the rest winds up the spring
            aim = way * most
            z = aim + (z - aim) * np.exp(-abs(moved) / most)
        out[i] = stiffness * z
    return out


def warmth(common_s: np.ndarray, rise_K: tuple[float, float], slow_s: tuple[float, float]) -> np.ndarray:
    """Temperature above 20 °C (n,) of the screws at times on the common clock: a quick part and a slow one."""
    late = np.clip(common_s, 0.0, None)
    return sum(rise * (1 - np.exp(-late / slow)) for rise, slow in zip(rise_K, slow_s, strict=True))
