"""The screw runs out: the carriage swings about its encoder once per turn (or per pitch of another period)."""

from collections.abc import Mapping

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Motion, Parameter

STAGE = "drive"
TARGET = "actuator"
SLIDES_ONLY = True
MOMENTARY = True
PLAIN = "a screw that runs out"
REMEDY = (
    "check the alignment of the screw and its coupling; a compensation table of the control or camcomp removes "
    "what stays"
)
SOURCE = "carriage minus encoder = amplitude sin(2 pi encoder / pitch + phase); v2pi of ISO 3408-3"
# even in frequency: neighbours differ by a quarter turn over 100 mm
_PITCHES = tuple(float(1.0 / f) for f in np.linspace(1.0, 1.0 / 40.0, 130))
PARAMETERS = (
    Parameter("amplitude_mm", "mm", 0.0, 0.0, 0.3, 0.005, 0.0001, "wobble of ball screws: 1 to 10 um", sign=1),
    Parameter("pitch_mm", "mm", 5.0, 0.5, 100.0, 1.0, 0.0, "screws of feed drives: 1 to 40 mm per turn"),
    Parameter("phase_rad", "rad", 0.0, -np.pi, np.pi, 2.0, 0.0, "any"),
)
# The effect is linear in its two components, which is what a fit needs; the scan finds the pitch.
FITTED = (
    Parameter("sine_mm", "mm", 0.0, -0.2, 0.2, 0.004, 0.00005, "as the amplitude"),
    Parameter("cosine_mm", "mm", 0.0, -0.2, 0.2, 0.004, 0.00005, "as the amplitude"),
    Parameter("pitch_mm", "mm", 5.0, 0.5, 100.0, 1.0, 0.0, "as above", scan=_PITCHES, turns=1.5),  # one wave is a bow
)


def public(fitted: Mapping[str, float]) -> dict[str, float]:
    """Amplitude, pitch and phase from the fitted components."""
    sine, cosine = fitted["sine_mm"], fitted["cosine_mm"]
    phase = float(np.arctan2(cosine, sine))
    return {"amplitude_mm": float(np.hypot(sine, cosine)), "pitch_mm": fitted["pitch_mm"], "phase_rad": phase}


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, float]) -> Floats:
    """Carriage minus encoder (n, m), mm."""
    amplitude = p["amplitude_mm"]
    if amplitude == 0.0:
        return error
    out = error.copy()
    for j in np.flatnonzero(which):
        phase = 2.0 * np.pi * motion.encoder[:, j] / p["pitch_mm"] + p["phase_rad"]
        out[:, j] += amplitude * np.sin(phase)
    return out
