"""Faults whose effects came to the library later: asked for by name, so that what seeds draw stays what it was.

Formulas of their own: a screw of warm turns whose nut is carried out by all of them, a loop as a filter of its set-points, a
push that comes and goes softly.  Size 1 is some 20 micrometres at the tip.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import cont2discrete, lfilter

from tests.validation.recorded.drives import STEP_S
from tests.validation.recorded.faults import Fault

KNOWN_AS = {"warm_screw": "screw_growth", "ringing_loop": "servo_overshoot", "pushed_drive": "disturbance"}
SOFT_S = 0.004


def fault(effect: str, target: str, size: float, seed: int, span_s: tuple[float, float]) -> Fault:
    """The fault of that size by the names of the library's parameters; span_s: of the common clock in which a push begins."""
    rng = np.random.default_rng([seed, 6])
    when, last, damping = float(rng.uniform(*span_s)), float(rng.uniform(2.0, 4.0)), float(rng.uniform(0.2, 0.6))
    if effect == "warm_screw":
        return Fault(effect, target, {"expansion_ppm_per_K": 40.0 * size})
    if effect == "ringing_loop":
        return Fault(effect, target, {"period_ms": 2 * np.pi * float(np.sqrt(40.0 * size)), "damping": damping})
    return Fault(effect, target, {"force_N": 300.0 * size, "from_s": when, "to_s": when + last})


def at_encoder(fault: Fault, i: int, setpoint: np.ndarray) -> np.ndarray:
    """Change by a loop of the encoder (n,) of actuator i on the grid of 1 ms."""
    if fault.effect != "ringing_loop":
        return np.zeros(len(setpoint))
    w, d = 2e3 * np.pi / fault.parameters["period_ms"], fault.parameters["damping"]
    b, a, _ = cont2discrete(([2 * d * w, w * w], [1.0, 2 * d * w, w * w]), STEP_S, method="foh")
    way = setpoint[:, i] - setpoint[0, i]
    return lfilter(b.ravel(), a, way) - way


def at_carriage(fault: Fault, nut: np.ndarray, home: float, warm: np.ndarray) -> np.ndarray:
    """Where a screw carries its nut (n,) mm beyond its scale, warm (n,) K above the temperature at which it was cut."""
    if fault.effect != "warm_screw":
        return np.zeros(len(nut))
    turns = nut - home  # of 1 mm
    return home + turns * (1.0 + 1e-6 * fault.parameters["expansion_ppm_per_K"] * warm) - nut


def push(fault: Fault, common: np.ndarray) -> np.ndarray:
    """Force (n,) N on the carriage along + at times on the common clock."""
    if fault.effect != "pushed_drive":
        return np.zeros(len(common))
    value = fault.parameters
    since, left = (common - value["from_s"]) / SOFT_S, (value["to_s"] - common) / SOFT_S
    return value["force_N"] * 0.5 * (1 - np.cos(np.pi * np.clip(np.minimum(since, left), 0, 1)))
