"""Errors of actuators in the runs of a study, by run and axis, and their noise floors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from camcomp.diagnosis.axis.findings import AxisChannel, AxisFindings
from camcomp.ground.datatypes import Floats
from camcomp.model.statics.arm import ARM_LENGTH

Errors = Mapping[str, tuple[Floats, Floats]]  # by axis: times (n,) s and errors (n,) mm or rad


def lever_mm(revolute: bool) -> float:
    """Way in mm by which an axis is studied per unit of its coordinate: 1 of a slide, that at the end of an arm of a hinge."""
    return ARM_LENGTH if revolute else 1.0


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
