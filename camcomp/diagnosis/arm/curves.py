"""The error curve of a joint as it is reported: from amplitudes of its waves, with its deviation and the angles that were seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.arm.poses import CURVE, ArmBench, Column, combined, wave
from camcomp.diagnosis.result.types import CurveCause, ErrorCurve, Estimate, FoundCause, six_digits
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats
from camcomp.model import signal_path
from camcomp.model.effect import Cause, Motion

DRAWN_DEG = 3.0  # step at which a curve is told


def curve_cause(
    bench: ArmBench, cause: FoundCause, columns: Sequence[Column], amount: Floats, covariance: Floats, wide: float
) -> CurveCause:
    """The cause with the curve of its joint, from waves (k,), their amplitudes (k,) and covariance (k, k).

    wide: half width of a 95 % interval in standard deviations.
    """
    joint = list(bench.actuators).index(str(cause.target))
    angle = np.arange(0.0, 360.0, DRAWN_DEG)
    shapes = np.stack([wave(c, np.radians(angle)) for c in columns], axis=1)
    scale = np.array([c.parameter.scale for c in columns])
    size = np.array([c.parameter.value(a * s) for c, a, s in zip(columns, amount, scale, strict=True)])
    amplitude = float(np.sqrt(0.5 * np.sum(size**2)))
    slope = 0.5 * size * scale / max(amplitude, 1e-300)
    half = wide * float(np.sqrt(slope @ covariance @ slope))
    seen = seen_angles(np.concatenate([bench.campaigns[k].q[:, joint] for k in bench.own]))
    sd = np.sqrt(np.maximum(np.einsum("nk,kl,nl->n", shapes, covariance, shapes), 0.0))
    found = combined(columns, dict(enumerate(amount)))[0]
    values = {**found.values, "seen_deg": [list(each) for each in seen], "band_rad": [float(s) for s in sd]}
    error = _drawn(replace(found, values=values), np.radians(angle))
    out = CurveCause(
        effect=cause.effect, target=cause.target, probability=cause.probability, share=cause.share,
        parameters={"amplitude_rad": Estimate.stated(amplitude, max(amplitude - half, 0.0), amplitude + half)},
        curve=ErrorCurve(
            angle_deg=tuple(angle), error_rad=tuple(six_digits(e) for e in error), sd_rad=tuple(six_digits(s) for s in sd),
            seen_deg=seen, seen_share=round(min(sum(high - low for low, high in seen) / 360.0, 1.0), 4),
        ),
    )  # fmt: skip
    out._settings = {
        key: [each if isinstance(each, list) else float(f"{each:.4g}") for each in value]
        for key, value in values.items() if isinstance(value, list)
    }  # fmt: skip
    return out


def seen_angles(angle: Floats) -> tuple[tuple[float, float], ...]:
    """Intervals of a turn, deg, low from -180 on, that angles (n,) rad of poses lie in; between two less than 2 FADE_DEG of the effect apart the curve does not fade to zero."""
    turn = np.unique(np.round((np.degrees(angle) + 180.0) % 360.0 - 180.0, 2))
    gaps = np.diff(turn, append=turn[0] + 360.0)
    ends = np.flatnonzero(gaps > 2.0 * shelf.load("effects", CURVE).FADE_DEG)
    if not len(ends):
        return ((-180.0, 180.0),)
    starts = np.roll((ends + 1) % len(turn), 1)
    out = []
    for first, last in zip(starts, ends, strict=True):
        low, high = float(turn[first]), float(turn[last])
        out.append((low, high if high >= low else high + 360.0))
    return tuple(sorted(out))


def covered(seen: Mapping[int, Sequence[tuple[float, float]]], q: Floats) -> np.ndarray:
    """Mask (n,) of poses q (n, m) whose joints all lie inside their measured intervals (by joint number, degrees)."""
    out = np.ones(len(q), bool)
    for joint, intervals in seen.items():
        angle = np.degrees(q[:, joint])
        inside = np.zeros(len(q), bool)
        for low, high in intervals:
            inside |= (angle - low) % 360.0 <= high - low + 1e-6
        out &= inside
    return out


def _drawn(cause: Cause, angle: Floats) -> Floats:
    """Error (n,) rad of a joint with a curve at angles (n,) rad, as the effect itself has it."""
    zero, none = np.zeros((len(angle), 1)), np.zeros(1)
    motion = Motion(
        time=angle, common=angle, cut_min=angle, temperature=None, encoder=angle[:, None], speed=zero, direction=zero,
        home=none, stiffness=none, ordered=False,
    )  # fmt: skip
    return signal_path.driven([cause], (str(cause.target),), motion)[0][:, 0]
