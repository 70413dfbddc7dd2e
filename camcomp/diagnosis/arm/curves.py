"""Error curves of an arm's joints: waves over the turn, taken together as one group behind all others.

Every wave of every hinge has the same prior, learnt from what predicts withheld poses of the campaigns that are fitted; that
is a Gaussian process per joint whose curve returns to zero, and its band to the prior's, within some degrees from the
angles that some pose had. Behind the others, because waves fit whatever is left: they may not stand in for geometry.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from camcomp.diagnosis.arm.discrepancy import Evidence, ResidualBlock
from camcomp.diagnosis.arm.fit import ArmFit, fit_of_leftovers, fitted, parts
from camcomp.diagnosis.arm.forward_selection import (
    LEAST_GAIN,
    LEAST_SHARE,
    Step,
    Taken,
    best_width,
    in_order,
    rms,
    widths_of,
)
from camcomp.diagnosis.arm.poses import CURVE, ArmBench, combined, wave
from camcomp.ground.datatypes import Floats
from camcomp.model import signal_path
from camcomp.model.effect import Cause, Motion

GAP_DEG = 6.0  # angles closer than this are one interval: less than the shortest wave, 9 deg, and twice the fade of the effect
DRAWN_DEG = 3.0  # step at which a curve is told
LEAST_PART = 0.01  # of the energy of all curves: joints with less need not be covered


def with_curves(bench: ArmBench, found: ArmFit) -> ArmFit:
    """The fit with error curves of the joints, where they predict withheld poses; else as it is."""
    waves = bench.waves()
    if not waves:
        return found
    columns = [*found.columns, *waves]
    groups = {**found.groups, CURVE: list(range(len(found.columns), len(columns)))}
    linear = [
        replace(b, X=np.concatenate([b.X, more.X], axis=2))
        for b, more in zip(found.linear, bench.blocks(waves), strict=True)
    ]
    discrepancy = fit_of_leftovers(linear)
    taken = curves_taken(Evidence.of(parts(linear), discrepancy), groups, found.taken)
    if CURVE not in {s.group for s in taken.steps}:
        return found
    return replace(fitted(bench, columns, groups, linear, discrepancy, taken, passes=1), rough=found.discrepancy)


def curves_taken(evidence: Evidence, groups: Mapping[str, Sequence[int]], before: Taken) -> Taken:
    """What was taken without waves, its steps as this evidence sees them, and the waves where they are worth it."""
    density, squares = evidence.predict(np.zeros(evidence.effects))
    none = replace(before.none, density=density, squares=squares)
    steps = in_order(evidence, groups, [(s.group, s.width) for s in before.steps])
    widths = widths_of(evidence, groups, steps)
    best, last = best_width(evidence, widths, CURVE, groups[CURVE]), (none, *steps)[-1]
    if best.density - last.density >= LEAST_GAIN and rms(best.squares) <= (1.0 - LEAST_SHARE) * rms(last.squares):
        steps = _needed(evidence, groups, [*steps, best])
    return replace(before, none=none, steps=tuple(steps), widths=widths_of(evidence, groups, steps))


def _needed(evidence: Evidence, groups: Mapping[str, Sequence[int]], steps: Sequence[Step]) -> list[Step]:
    """Steps without those that only stood in for waves before these came: beside them, they gain nothing."""
    while True:
        for i in range(len(steps) - 1):
            less = in_order(evidence, groups, [(s.group, s.width) for k, s in enumerate(steps) if k != i])
            if less[-1].density > steps[-1].density - LEAST_GAIN:
                steps = less
                break
        else:
            return list(steps)


def without_waves(blocks: Sequence[ResidualBlock], groups: Mapping[str, Sequence[int]]) -> list[ResidualBlock]:
    """Blocks without the columns of waves, which are the last ones."""
    count = min(groups.get(CURVE, [blocks[0].X.shape[2]]))
    return [replace(b, X=b.X[:, :, :count]) for b in blocks]


# -- a curve as it is told --------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
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


def curve_of(bench: ArmBench, found: ArmFit, target: str) -> CurveOfJoint:
    """The curve of a joint with what is known of it."""
    own = [j for j in _curved(found) if found.columns[j].target == target]
    joint = list(bench.actuators).index(target)
    columns = [found.columns[j] for j in own]
    amount, covariance = found.amount[own], found.covariance[np.ix_(own, own)]
    angle = np.arange(0.0, 360.0, DRAWN_DEG)
    shapes = np.stack([wave(c, np.radians(angle)) for c in columns], axis=1)
    size = np.array([c.parameter.scale for c in columns]) * amount
    amplitude = float(np.sqrt(0.5 * np.sum(size**2)))
    slope = 0.5 * size * np.array([c.parameter.scale for c in columns]) / max(amplitude, 1e-300)
    seen = seen_angles(np.concatenate([each.q[:, joint] for each in bench.campaigns]))
    sd = np.sqrt(np.maximum(np.einsum("nk,kl,nl->n", shapes, covariance, shapes), 0.0))
    cause = combined(columns, dict(enumerate(amount)))[0]
    values: dict[str, Any] = {
        **cause.values,
        "seen_deg": [list(each) for each in seen],
        "band_rad": [float(s) for s in sd],
    }
    error = _drawn(replace(cause, values=values), np.radians(angle))
    return CurveOfJoint(angle, error, sd, amplitude, float(np.sqrt(slope @ covariance @ slope)), seen, values)


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
    """Which poses q (n, m) have every joint (its number) inside of what was seen of it: a mask (n,)."""
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
    motion = Motion(angle, angle, angle, None, angle[:, None], zero, zero, none, none, False)
    return signal_path.driven([cause], (str(cause.target),), motion)[0][:, 0]


def _curved(found: ArmFit) -> list[int]:
    """Columns of the waves that were taken."""
    return [int(j) for j in np.flatnonzero(found.taken.widths) if found.columns[int(j)].effect == CURVE]


def curved_joints(bench: ArmBench, found: ArmFit) -> list[int]:
    """Numbers of the joints whose curve matters: LEAST_PART of what all curves move the tips by, or more."""
    energy = np.zeros(len(bench.actuators))
    for j in _curved(found):
        a = bench.actuators.index(str(found.columns[j].target))
        energy[a] += sum(float((b.X[:, :, j] ** 2).sum()) for b in found.linear) * found.amount[j] ** 2
    return [int(a) for a in np.flatnonzero(energy > LEAST_PART * max(float(energy.sum()), 1e-300))]
