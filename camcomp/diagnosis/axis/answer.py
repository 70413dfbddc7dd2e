"""The parts of an axis study's result: gap, what is unknown, where and when, and how far the gap shrinks on unseen runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from camcomp.diagnosis.answer.unseen import JudgedRun, unseen_shrinkage
from camcomp.diagnosis.axis.findings import AxisChannel, AxisFindings, lever_mm
from camcomp.diagnosis.axis.gate import KNOWN
from camcomp.diagnosis.axis.surroundings import AxisSurroundings, Errors
from camcomp.diagnosis.model.folds import REGIONS
from camcomp.diagnosis.result.types import (
    ActuatorGap,
    ActuatorShrinkage,
    Driver,
    Estimate,
    FoundCause,
    GapSize,
    IntervalShare,
    RippleDriver,
    UnknownCause,
    UnseenShrinkage,
    Where,
)
from camcomp.diagnosis.statistics.places import shares
from camcomp.diagnosis.statistics.probability import EVEN, probability_of_chance, stated
from camcomp.ground.datatypes import Floats
from camcomp.model.motion.log_columns import log_columns


def unknown(axis: AxisFindings, whole: int) -> UnknownCause:
    """The unknown cause of an axis: its share of the gap, and its probability (even odds where no test shows it)."""
    shares = []
    for channel in axis.channels:
        first, left = channel.squares
        parts = [share for _, share in axis.unknown_in] if channel is axis.channels[-1] else []
        if axis.ripple and channel is axis.force:
            parts.append(axis.ripple.share)
        if channel.gate.above:
            parts.append(max(1.0 - channel.floor**2 / max(left, 1e-300), 0.0))
        shares.append(max(parts, default=0.0) * left / max(first, 1e-300))
    probability = stated(probability_of_chance(axis.unknown_chance)) if axis.strange else EVEN
    share = round(min(sum(shares) / whole, 1.0), 6)
    return UnknownCause(target=axis.name, probability=probability, share=share, law=axis.law)


def gap(found: Sequence[AxisFindings], tip: AxisSurroundings) -> GapSize:
    """Size of the errors of position at the tip in um, and of every actuator in its own unit; where only forces were logged, of these in mN."""
    errors = whole_errors(found)
    if not errors:
        rows = [c.rows for a in found for c in a.channels[:1]]
        size = np.abs(np.concatenate([each - np.mean(each) for each in rows]))
        floor = float(np.sqrt(np.mean([a.channels[0].floor ** 2 for a in found])))
    else:
        size = np.concatenate([tip.errors(run, each) for run, each in errors.items()])
        floors = {a.name: position_floor(a) for a in found}
        times = {run: max((t for t, _ in each.values()), key=len) for run, each in errors.items()}
        floor = _rms(np.concatenate([tip.floor(run, time, floors) for run, time in times.items()]))
    actuators = {
        a.name: ActuatorGap(
            rms=_figure(a, _rms(np.concatenate([each[a.name][1] for each in errors.values() if a.name in each]))),
            floor=_figure(a, position_floor(a)), unit=_unit(a),
        )
        for a in found if a.following is not None or a.behind is not None
    }  # fmt: skip
    return GapSize.of(1e3 * size, 1e3 * floor, actuators=actuators)


def _figure(axis: AxisFindings, size: float) -> float:
    """A size in the study's mm, in um of a slide and urad of a hinge."""
    return round((1e6 / lever_mm(True) if axis.revolute else 1e3) * size, 3)


def _unit(axis: AxisFindings) -> Literal["um", "urad"]:
    return "urad" if axis.revolute else "um"


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def where(found: Sequence[AxisFindings], causes: Sequence[FoundCause]) -> Where:
    """Shares of axes; covariates of the residuals, and the intervals in which they exceed the floor."""
    known = [c for c in causes if not isinstance(c, UnknownCause)]
    share = shares({a.name: c.squares[0] for a in found if (c := a.following or a.force) is not None})
    drivers: list[Driver] = []
    for a in found:
        if (line := a.ripple) is not None:
            drivers.append(
                RippleDriver(
                    covariate=f"position:{a.name}",
                    share=round(line.share, 4),
                    channel=log_columns([a.name], [False]).drive[0],
                    period_mm=round(line.period, 4),
                    amplitude_N=round(line.amplitude, 3),
                    forward_N=round(line.forward, 3),
                    backward_N=round(line.backward, 3),
                )
            )
        largest = dict(sorted(a.unknown_in, key=lambda each: each[1]))
        drivers += [Driver(covariate=name, share=round(share, 4)) for name, share in largest.items()]
    lag = any(c.effect in ("servo_lag", "speed_limit") for c in known)
    return Where(
        stage="control" if lag or not known else "drive",
        axes={axis: share.get(axis, 0.0) for axis in "xyz"},
        actuators=share,
        drivers=tuple(sorted(drivers, key=lambda d: -d.share)),
        intervals=_intervals(found),
    )


def _intervals(found: Sequence[AxisFindings]) -> tuple[IntervalShare, ...]:
    every = [i for a in found for c in a.channels for i in c.gate.intervals]
    tidy = [
        i.model_copy(update={"t0_s": round(i.t0_s, 6), "t1_s": round(i.t1_s, 6), "share": round(i.share, 4)})
        for i in every
    ]
    return tuple(sorted(tidy, key=lambda each: -each.share))


def shrinkage(judged: Sequence[Sequence[AxisFindings]], names: Sequence[str], tip: AxisSurroundings) -> UnseenShrinkage:
    """On whole runs that took no part in choosing and fitting, one per fit."""
    effects = list(dict.fromkeys((c.effect, c.target) for found in judged for a in found for c in a.causes))
    runs = []
    for found in judged:
        before, after = (_unseen(found, tip, explained=each) for each in (False, True))
        parts = np.arange(len(before)) * REGIONS // len(before)
        runs.append(JudgedRun([before, *[after] * max(len(effects), 1)], parts))
    return unseen_shrinkage(runs, effects, holdout=tuple(names), actuators=_actuators_unseen(judged))


def _unseen(found: Sequence[AxisFindings], tip: AxisSurroundings, *, explained: bool) -> Floats:
    """Squares (n,) of the distance of the tip, mm2, on withheld runs; of drive forces, N2, where the logs lack set-points."""
    errors = held_errors(found, explained=explained)
    if errors:
        return np.concatenate([tip.errors(run, each) ** 2 for run, each in errors.items()])
    runs = [r for a in found for c in a.channels[:1] for r in c.held]
    return np.concatenate([(r.left if explained else r.gap) ** 2 for r in runs])


def _actuators_unseen(judged: Sequence[Sequence[AxisFindings]]) -> dict[str, ActuatorShrinkage]:
    """Rms errors of every actuator on withheld runs, without and with the causes."""
    out = {}
    for name in dict.fromkeys(a.name for found in judged for a in found if a.following is not None):
        axes = [a for found in judged for a in found if a.name == name and a.following is not None]
        held = [r for a in axes if a.following for r in a.following.held]
        parts = [
            np.concatenate([np.zeros(0 if held else 1), *each])
            for each in ([r.gap for r in held], [r.left for r in held])
        ]
        before, after = (_figure(axes[0], _rms(each)) for each in parts)
        out[name] = ActuatorShrinkage(before_rms=before, after_rms=after, unit=_unit(axes[0]))
    return out


def share_lag(found: Sequence[AxisFindings]) -> None:
    """One lag where one common value serves for all axes that move (contract, section 5): each within two KNOWN of it."""
    moving = [
        a
        for a in found
        if a.following is not None and any(float(np.ptp(r.move.position)) > 0 for r in a.following.fitted)
    ]
    lags = [(a, c) for a in moving for c in a.causes if c.effect == "servo_lag"]
    if len(lags) < 2 or len(lags) < len(moving):
        return
    each = [c.parameters["time_constant_ms"] for _, c in lags]
    value, half = np.array([e.value for e in each]), np.array([0.5 * (e.ci95[1] - e.ci95[0]) for e in each])
    weight = 1.0 / np.maximum(half, 1e-12) ** 2
    common = float(weight @ value / weight.sum())
    if np.any(np.abs(value - common) > np.maximum(half, 2.0 * KNOWN * abs(common))):
        return
    spread = max(KNOWN * abs(common), float(weight.sum() ** -0.5), float(np.std(value)))
    together = FoundCause(
        effect="servo_lag",
        target=None,
        probability=min(c.probability for _, c in lags),
        share=float(sum(c.share for _, c in lags)),
        parameters={"time_constant_ms": Estimate.stated(common, common - spread, common + spread)},
    )
    for a, c in lags:
        a.causes.remove(c)
    lags[0][0].causes.append(together)


def whole_errors(found: Sequence[AxisFindings]) -> dict[str, Errors]:
    """Errors by run and axis: set-point minus encoder, and encoder minus second encoder, each about its mean over the runs."""
    return _by_run(found, lambda c: [(r.name, r.whole[0], r.whole[1] - float(np.mean(c.rows))) for r in c.fitted])


def held_errors(found: Sequence[AxisFindings], *, explained: bool) -> dict[str, Errors]:
    """Errors of withheld runs by run and axis, minus their constant or minus the fitted model."""
    return _by_run(found, lambda c: [(r.name, r.move.time, r.left if explained else r.gap) for r in c.held])


def position_floor(axis: AxisFindings) -> float:
    """Noise of the error of an axis, in the study's mm: of a channel at most the error that was measured."""
    return float(np.sqrt(sum(min(c.floor**2, float(np.var(c.rows))) for _, c, _ in _channels([axis]))))


def _channels(found: Sequence[AxisFindings]) -> list[tuple[AxisFindings, AxisChannel, float]]:
    """Axes with their channels of position, and the sign with which these add up to set-point minus carriage."""
    both = [(a, c, sign) for a in found for c, sign in ((a.following, 1.0), (a.behind, -1.0))]
    return [(a, c, sign) for a, c, sign in both if c is not None]


def _by_run(
    found: Sequence[AxisFindings], of: Callable[[AxisChannel], list[tuple[str, Floats, Floats]]]
) -> dict[str, Errors]:
    """Errors by run and axis, at the times of its first channel; of: runs, times (n,) and values (n,) of a channel."""
    out: dict[str, dict[str, tuple[Floats, Floats]]] = {}
    for a, channel, sign in _channels(found):
        for run, time, values in of(channel):
            errors = out.setdefault(run, {})
            at, own = errors.get(a.name, (time, np.zeros(len(time))))
            errors[a.name] = at, own + np.interp(at, time, sign * values)
    return dict(out)
