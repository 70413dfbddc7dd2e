"""The error curve of a joint as it is reported: from amplitudes of its waves, with its deviation and the angles that were seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from camcomp.diagnosis.arm.poses import ArmBench, Column, combined, wave
from camcomp.ground.datatypes import Floats
from camcomp.model import signal_path
from camcomp.model.effect import Cause, Motion

GAP_DEG = 6.0  # angles closer than this are one interval: less than the shortest wave, 9 deg, and twice the fade of the effect
DRAWN_DEG = 3.0  # step at which a curve is told


@dataclass(frozen=True, eq=False, kw_only=True)
class CurveOfJoint:
    """The curve of one joint: angles (n,) deg, error and deviation (n,) rad; amplitude with deviation, rad; intervals seen.

    values: what the effect has in YAML.
    """

    angle: Floats
    error: Floats
    sd: Floats
    amplitude: float
    amplitude_sd: float
    seen: tuple[tuple[float, float], ...]
    values: Mapping[str, Any]

    @property
    def seen_share(self) -> float:
        """Share of a turn that was seen."""
        return min(sum(high - low for low, high in self.seen) / 360.0, 1.0)


def curve_of(bench: ArmBench, columns: Sequence[Column], amount: Floats, covariance: Floats) -> CurveOfJoint:
    """The curve of a joint from its waves (k,), their amplitudes (k,) and covariance (k, k)."""
    joint = list(bench.actuators).index(str(columns[0].target))
    angle = np.arange(0.0, 360.0, DRAWN_DEG)
    shapes = np.stack([wave(c, np.radians(angle)) for c in columns], axis=1)
    size = np.array([c.parameter.value(a * c.parameter.scale) for c, a in zip(columns, amount, strict=True)])
    amplitude = float(np.sqrt(0.5 * np.sum(size**2)))
    slope = 0.5 * size * np.array([c.parameter.scale for c in columns]) / max(amplitude, 1e-300)
    seen = seen_angles(np.concatenate([bench.campaigns[k].q[:, joint] for k in bench.own]))
    sd = np.sqrt(np.maximum(np.einsum("nk,kl,nl->n", shapes, covariance, shapes), 0.0))
    cause = combined(columns, dict(enumerate(amount)))[0]
    values: dict[str, Any] = {
        **cause.values,
        "seen_deg": [list(each) for each in seen],
        "band_rad": [float(s) for s in sd],
    }
    error = _drawn(replace(cause, values=values), np.radians(angle))
    return CurveOfJoint(
        angle=angle, error=error, sd=sd, amplitude=amplitude, amplitude_sd=float(np.sqrt(slope @ covariance @ slope)),
        seen=seen, values=values,
    )  # fmt: skip


def seen_angles(angle: Floats) -> tuple[tuple[float, float], ...]:
    """Intervals of a turn, deg, low from -180 on, that angles (n,) rad of poses lie in; gaps below GAP_DEG are none."""
    turn = np.unique(np.round((np.degrees(angle) + 180.0) % 360.0 - 180.0, 2))
    gaps = np.diff(turn, append=turn[0] + 360.0)
    ends = np.flatnonzero(gaps > GAP_DEG)
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
