"""A joint of an arm turns unevenly: its error repeats with every turn, as gears and eccentric encoders make it."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from camcomp.ground.datatypes import Floats
from camcomp.model.config.base import Spec
from camcomp.model.effect import Motion, Parameter

STAGE = "drive"
TARGET = "actuator"
MOMENTARY = True
PLAIN = "a joint that turns unevenly"
REMEDY = "take the curve out in the program where it was seen, measure poses at the angles it was not, and look at the gear where it is large"
ARM_ONLY = True
SOURCE = (
    "Fourier series of the transmission error over a turn; strain-wave gears: Tuttle, Seering, IEEE Trans. Robotics and "
    "Automation 12 (1996) 368"
)
WAVES = 40  # per turn that a diagnosis looks for; calibrations of gears report periods down to some degrees
FADE_DEG = 3.0  # outside of what was seen the correction goes to zero over a third of the shortest wave
_SIZE = "transmission errors of robot joints: 0.1 to 1 mrad, shared by some tens of waves"
PARAMETERS = (
    Parameter(
        "amplitude_rad", "rad", 0.0, 0.0, 0.02, 1e-4, 1e-6, "root mean square over a turn: 0.01 to 0.3 mrad", sign=1
    ),
)
FITTED = tuple(
    Parameter(f"{name}_{k}_rad", "rad", 0.0, -0.003, 0.003, 3e-5, 1e-6, _SIZE)
    for name in ("sine", "cosine")
    for k in range(1, WAVES + 1)
)
ROTARY = FITTED


def _rising(ends: list[float]) -> list[float]:
    if ends[0] > ends[1]:
        raise PydanticCustomError("CC205", f"an interval goes from its lower to its higher end, not {ends}")
    return ends


_Angle = Annotated[float, Field(ge=-720.0, le=720.0)]
_Interval = Annotated[list[_Angle], Field(min_length=2, max_length=2), AfterValidator(_rising)]


class Params(Spec):
    """Measured deviations of a curve, for reports."""

    sine: list[float] = Field([], max_length=500, description="of 1, 2, ... waves per turn, over amplitude_rad")
    cosine: list[float] = Field([], max_length=500, description="of 1, 2, ... waves per turn, over amplitude_rad")
    seen_deg: list[_Interval] = Field(
        [], max_length=360, description="[low, high] angles where it was seen, outside it fades to 0; none: all around"
    )
    band_rad: list[Annotated[float, Field(ge=0.0)]] = Field(
        [], max_length=3600, description="deviation of the curve at angles equally spaced from 0; changes nothing"
    )


def public(fitted: Mapping[str, float]) -> dict[str, Any]:
    """Amplitude and shape from the fitted waves."""
    waves = [[fitted.get(f"{name}_{k}_rad", 0.0) for k in range(1, WAVES + 1)] for name in ("sine", "cosine")]
    amplitude = float(np.sqrt(0.5 * np.sum(np.square(waves))))
    if amplitude == 0.0:
        return {"amplitude_rad": 0.0, "sine": [], "cosine": []}
    sine, cosine = ([each / amplitude for each in own] for own in waves)
    return {"amplitude_rad": amplitude, "sine": sine, "cosine": cosine}


def on_drive(error: Floats, motion: Motion, which: Floats, p: Mapping[str, Any]) -> Floats:
    """Joint minus encoder (n, m), rad."""
    amplitude = p["amplitude_rad"]
    sine, cosine = p.get("sine", ()), p.get("cosine", ())
    if amplitude == 0.0 or not (len(sine) or len(cosine)):
        return error
    out = error.copy()
    for j in np.flatnonzero(which):
        angle = motion.encoder[:, j]
        out[:, j] += amplitude * _fade(angle, p.get("seen_deg", ())) * _series(angle, sine, cosine)
    return out


def _series(angle: Floats, sine: Sequence[float], cosine: Sequence[float]) -> Floats:
    """Sum (n,) of sine[k-1] sin(k angle) + cosine[k-1] cos(k angle) by Horner's rule in exp(i angle)."""
    terms = np.zeros(max(len(sine), len(cosine)), complex)
    terms[: len(sine)] -= 1j * np.asarray(sine)
    terms[: len(cosine)] += np.asarray(cosine)
    turn = np.exp(1j * angle)
    total = np.zeros(len(angle), complex)
    for term in terms[::-1]:
        total = (total + term) * turn
    return total.real


def _fade(angle: Floats, seen_deg: Sequence[Sequence[float]]) -> Floats | float:
    """Weight (n,) of the curve: 1 where it was seen, 0 from FADE_DEG outside."""
    if not len(seen_deg):
        return 1.0
    low, high = np.asarray(seen_deg, float).T
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    off = np.abs((np.degrees(angle)[:, None] - middle + 180.0) % 360.0 - 180.0) - half
    return np.asarray(np.clip(1.0 - off.min(axis=1) / FADE_DEG, 0.0, 1.0))
