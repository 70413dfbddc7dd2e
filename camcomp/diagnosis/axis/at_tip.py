"""Errors of actuators in the runs of a study, by run and axis, and their noise floors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

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
    out: dict[str, dict[str, tuple[Floats, Floats]]] = {}
    for a, channel, sign in _channels(found):
        middle = float(np.mean(channel.rows))
        for r in channel.fitted:
            _add(out.setdefault(r.name, {}), a.name, r.whole[0], sign * (r.whole[1] - middle))
    return dict(out)


def held_errors(found: Sequence[AxisFindings], *, explained: bool) -> dict[str, Errors]:
    """Errors of withheld runs by run and axis, minus their constant or minus the fitted model."""
    out: dict[str, dict[str, tuple[Floats, Floats]]] = {}
    for a, channel, sign in _channels(found):
        for r in channel.held:
            _add(out.setdefault(r.name, {}), a.name, r.move.time, sign * (r.left if explained else r.gap))
    return dict(out)


def position_floor(axis: AxisFindings) -> float:
    """Noise of the error of an axis, in the study's mm: of a channel at most the error that was measured."""
    return float(np.sqrt(sum(min(c.floor**2, float(np.var(c.rows))) for _, c, _ in _channels([axis]))))


def _channels(found: Sequence[AxisFindings]) -> list[tuple[AxisFindings, AxisChannel, float]]:
    """Axes with their channels of position, and the sign with which these add up to set-point minus carriage."""
    both = [(a, c, sign) for a in found for c, sign in ((a.following, 1.0), (a.behind, -1.0))]
    return [(a, c, sign) for a, c, sign in both if c is not None]


def _add(errors: dict[str, tuple[Floats, Floats]], name: str, time: Floats, values: Floats) -> None:
    """Add errors (n,) of a channel to those of an axis, at the times of its first channel."""
    if name in errors:
        at, own = errors[name]
        errors[name] = at, own + np.interp(at, time, values)
    else:
        errors[name] = time, values
