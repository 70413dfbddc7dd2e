"""Errors of actuators carried to the tip: dx = J(q) e, row by row, and the same for their noise floors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.axis.findings import AxisChannel, AxisFindings, AxisRun
from camcomp.ground.datatypes import Floats
from camcomp.model.statics.arm import ARM_LENGTH, Arm, arm_of, end_pose, jacobian
from camcomp.model.statics.description import Robot

POSES = 400  # of a run at which the rates of the machine are worked out; between them they are straight

Errors = Mapping[str, tuple[Floats, Floats]]  # by axis: times (n,) s and errors (n,) mm or rad


def lever_mm(revolute: bool) -> float:
    """Way in mm by which an axis is studied per unit of its coordinate: 1 of a slide, that at the end of an arm of a hinge."""
    return ARM_LENGTH if revolute else 1.0


@dataclass(frozen=True, eq=False)
class TipMotion:
    """Carries errors of actuators to the tip. axes: runs by axis, in the axes' study's units (mm per lever)."""

    robot: Robot | None
    axes: Mapping[str, Sequence[AxisRun]]

    def errors(self, run: str, errors: Errors) -> Floats:
        """Distances (n,) mm of the tip in a run, at the times of the axis with the most rows."""
        time = max((t for t, _ in errors.values()), key=len)
        rates = self._rates(run, time)
        own = np.column_stack([
            np.interp(time, *errors[name]) / lever_mm(hinge) if name in errors else np.zeros(len(time))
            for name, hinge in self._actuators
        ])  # fmt: skip
        return np.asarray(np.sqrt(np.sum(np.einsum("nij,nj->ni", rates, own) ** 2, axis=1)))

    def floor(self, run: str, time: Floats, floors: Mapping[str, float]) -> Floats:
        """Standard deviations (n,) mm of the tip, of floors by axis."""
        each = np.array([floors.get(name, 0.0) / lever_mm(hinge) for name, hinge in self._actuators])
        return np.asarray(np.sqrt(np.sum((self._rates(run, time) * each) ** 2, axis=(1, 2))))

    @property
    def _actuators(self) -> list[tuple[str, bool]]:
        """Names, and whether they turn."""
        if self.robot is None:
            return [(name, any(r.revolute for r in runs)) for name, runs in self.axes.items()]
        return [(a.name, a.revolute) for a in self.robot.actuators]

    def _rates(self, run: str, time: Floats) -> Floats:
        """Motion (n, i, m) of the tip per unit of every actuator; a slide of a machine that is no arm moves it by its own error."""
        arm, m = None if self.robot is None else arm_of(self.robot), len(self._actuators)
        if arm is None:
            return np.broadcast_to(np.eye(m), (len(time), m, m))
        at = np.unique(np.linspace(0, len(time) - 1, min(POSES, len(time))).round().astype(int))
        q = np.column_stack(
            [self._position(run, a.name, time[at], home) for a, home in zip(arm.actuators, arm.start, strict=True)]
        )
        rates = np.array([self._tip_rates(arm, row) for row in q])
        out = np.empty((len(time), 3, m))
        for i in range(3):
            for j in range(m):
                out[:, i, j] = np.interp(time, time[at], rates[:, i, j])
        return out

    def _tip_rates(self, arm: Arm, q: Floats) -> Floats:
        """Rates (3, m) of the tip at joint coordinates q (m,)."""
        assert self.robot is not None
        twist, (rotation, _) = jacobian(arm, q), end_pose(arm, q)
        return np.asarray(twist[:3] + np.cross(twist[3:].T, rotation @ self.robot.tool).T)

    def _position(self, run: str, axis: str, time: Floats, home: float) -> Floats:
        """Coordinates (n,) of an axis in a run, mm or rad; where it is not logged it stands in its start pose."""
        own = next((each for each in self.axes.get(axis, ()) if each.name == run), None)
        known = np.zeros(0, bool) if own is None else np.isfinite(own.encoder)
        if own is None or not known.any():
            return np.full(len(time), home)
        return np.interp(time, own.time[known], own.encoder[known]) / lever_mm(own.revolute)


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
