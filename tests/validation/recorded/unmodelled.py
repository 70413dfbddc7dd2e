"""Faults that no library has.  Each changes the encoders, the carriages or the tip; size 1 is some 20 micrometres at the tip.

Values beside the size (`target` picks the actuator or axis): place mm, period mm or s, when and last s on the common clock.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import cont2discrete, lfilter

from tests.validation.recorded.drives import STEP_S
from tests.validation.recorded.faults import Fault

if TYPE_CHECKING:
    from tests.validation.recorded.plant import State

ON_ACTUATORS = ("servo_resonance", "guide_bump", "disturbed_drive", "hardening", "crosstalk")  # the others: x, y, z
# name -> (stage where it lives, what it truly depends on: beginnings of covariates that a report may name)
STRANGE: dict[str, tuple[str, tuple[str, ...]]] = {
    "servo_resonance": ("control", ("acceleration", "time", "velocity", "reversal")),
    "guide_bump": ("drive", ("position",)),
    "rack_period": ("structure", ("position",)),
    "straightness": ("structure", ("position",)),
    "twist": ("structure", ("position",)),
    "disturbed_drive": ("drive", ("time",)),
    "hardening": ("structure", ("force", "direction")),
    "crosstalk": ("structure", ("force", "direction")),
    "creep": ("structure", ("time", "force", "temperature")),
    "joint_hysteresis": ("structure", ("reversal", "direction", "velocity", "position")),
    "clamp_slip": ("workpiece", ("time",)),
    "breathing": ("structure", ("time", "temperature")),
}


def strange(effect: str, target: str, size: float, seed: int, span_s: tuple[float, float]) -> Fault:
    """The fault of that size; span_s: the part of the common clock in which something may happen."""
    rng = np.random.default_rng([seed, 5])
    drawn = {
        "place_mm": float(rng.uniform(-15, 15)),
        "width_mm": float(rng.uniform(4, 9)),
        "period_mm": float(rng.uniform(17, 37)),
        "period_s": float(rng.uniform(25, 90)),
        "hertz": float(rng.uniform(7, 16)),
        "phase": float(rng.uniform(0, 6)),
        "when_s": float(rng.uniform(*span_s)),
        "last_s": float(rng.uniform(2.0, 4.0)),
    }
    return Fault(effect, target, {"size": size, **drawn})


def at_encoder(fault: Fault, i: int, setpoint: np.ndarray) -> np.ndarray:
    """Addition to the encoder (n,) of actuator i on the grid of 1 ms."""
    if fault.effect != "servo_resonance":
        return np.zeros(len(setpoint))
    value, damping = fault.parameters, 0.06  # a soft coupling in the loop rings at every change of acceleration
    w = 2 * np.pi * value["hertz"]
    b, a, _ = cont2discrete(([-1.0, 0.0, 0.0], [1.0, 2 * damping * w, w * w]), STEP_S, method="foh")
    return 0.3 * value["size"] * lfilter(b.ravel(), a, setpoint[:, i] - setpoint[0, i])


def at_carriage(fault: Fault, i: int, s: State) -> np.ndarray:
    """Addition to the carriage (n,) of actuator i, mm or rad."""
    value, size, load = fault.parameters, fault.parameters["size"], s.load / s.reach
    return _at_carriage(fault.effect, value, size, (s.setpoint[:, i] - s.middle[i]) * s.reach, i, load, s) / s.reach


def _at_carriage(
    effect: str, value: dict[str, float], size: float, way: np.ndarray, i: int, load: np.ndarray, s: State
) -> np.ndarray:
    """The same in mm at the tip, about; way (n,) mm from the middle; load (n, m) N."""
    if effect == "guide_bump":
        return 0.05 * size * np.exp(-(((way - value["place_mm"]) / value["width_mm"]) ** 2))
    if effect == "disturbed_drive":
        u = s.common - value["when_s"]
        return 0.06 * size * ((u >= 0) & (u < value["last_s"]))
    if effect == "hardening":  # the drive gives way less and less under load: what a straight spring misses
        return 1e-6 * size * load[:, i] * np.abs(load[:, i])
    if effect == "crosstalk":
        return 2e-4 * size * load[:, (i + 1) % load.shape[1]]
    return np.zeros(len(s.t))


def at_tip(fault: Fault, s: State) -> np.ndarray:
    """Addition to the tip (n, 3), mm, program frame."""
    value, size, out = fault.parameters, fault.parameters["size"], np.zeros((len(s.t), 3))
    if fault.effect in ON_ACTUATORS:
        return out
    axis = "xyz".index(fault.target or "x")
    across = (axis + 1) % 3 if axis < 2 else 0
    here = s.commanded[:, across]
    if fault.effect == "straightness":
        out[:, axis] = 0.03 * size * np.sin((here - value["place_mm"]) / 12.0) * np.cos(here / 19.0)
    elif fault.effect == "rack_period":
        out[:, axis] = 0.03 * size * np.sin(2 * np.pi * here / value["period_mm"] + value["phase"])
    elif fault.effect == "twist":
        out[:, axis] = 0.04 * size * ((s.commanded[:, 0] / 25) ** 2 - 0.4) * (s.commanded[:, 1] / 25)
    elif fault.effect == "creep":
        out[:, axis] = -0.02 * size * np.log1p(s.cut_min / 0.1) * (0.4 + 0.6 * s.cuts)
    elif fault.effect == "clamp_slip":
        out[s.common >= value["when_s"]] = 0.04 * size * np.array([0.7, -0.6, 0.3])
    elif fault.effect == "breathing":
        out[:, axis] = 0.03 * size * np.sin(2 * np.pi * s.common / value["period_s"] + value["phase"])
    elif fault.effect == "joint_hysteresis":
        out = 0.03 * size * s.dragged * np.array([1.0, 0.5, 0.0])
    return out
