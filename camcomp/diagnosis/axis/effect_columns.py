"""Columns of library effects in the channels of one axis, through the signal path: a machine whose tip is not measured.

    encoder - set-point = control(set-points)      load - encoder = drive(encoders) - load of the drive / stiffness
    drive force = effort(encoders)

An effect that is linear in its parameter has its column once and for all; any other one is made linear where the fit stands.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import product
from typing import Any, Literal

import numpy as np

from camcomp.diagnosis.axis.findings import AxisRun
from camcomp.diagnosis.model.noise import REPEATABILITY_MM
from camcomp.ground import shelf
from camcomp.ground.datatypes import Bools, Floats
from camcomp.model import signal_path
from camcomp.model.effect import Cause, Motion, Parameter, applies, nominal, public_values
from camcomp.model.hysteresis import direction
from camcomp.model.law.covariates import DriveRows
from camcomp.model.law.expression import parse
from camcomp.model.law.spec import known_names
from camcomp.model.motion.between_rows import between_rows
from camcomp.model.seams import Seams
from camcomp.model.statics.description import Actuator, Robot
from camcomp.model.statics.masses import MassLoads

ChannelName = Literal["following", "behind", "force"]
# of standing poses; of an interval that is searched; laws; a zero of an encoder
ELSEWHERE = ("joint_hysteresis", "joint_curve", "disturbance", "formula", "map", "joint_offset")

# Parameters of friction beside its Coulomb force, by hinge: with the speed, and with its size; then the force that standstill
# adds, and the speed that ends it.
DRAG = {False: ("viscous_Ns_per_mm", "asymmetry_Ns_per_mm"), True: ("viscous_Nmms_per_rad", "asymmetry_Nmms_per_rad")}
LOAD = "(followed_weight_Nmm + followed_inertia_Nmm)"  # of the stated masses on a joint
STRIBECK = {False: ("stribeck_N", "stribeck_mm_per_s"), True: ("stribeck_Nmm", "stribeck_rad_per_s")}


@dataclass(frozen=True, eq=False, kw_only=True)
class AxisCause:
    """A candidate of one axis: parameters (d,) that are fitted, in units of their scales, and its shape.

    ways: number of shapes that were tried for its place. run: the one in which it acts, None for all.
    known: to what values of its shape are known. least: below what they are nothing of its own. steps (d,): amplitudes at which an
    absent cause is made linear, in scales.
    """

    effect: str
    module: Any
    target: str
    parameters: tuple[Parameter, ...]
    shape: Mapping[str, float]
    ways: float = 1.0
    run: str | None = None
    known: Mapping[str, float] = field(default_factory=dict)
    least: Mapping[str, float] = field(default_factory=dict)
    steps: tuple[float, ...] = ()

    @property
    def free(self) -> list[str]:
        """Names of its shape that may have any value above 0."""
        switches = {p.name for p in getattr(self.module, "FITTED", ()) if p.either}
        return [name for name, value in self.shape.items() if name not in switches and self.run is None and value > 0.0]

    def bounded(self, name: str, value: float) -> float:
        """A value of its shape between the bounds of its parameter."""
        own = next(p for p in self.module.PARAMETERS if p.name == name)
        return float(min(max(value, own.low, self.least.get(name, own.low)), own.high))

    @property
    def of_its_own(self) -> bool:
        """Whether its shape is above what is nothing of its own."""
        return all(self.shape.get(name, np.inf) > value for name, value in self.least.items())

    @property
    def place(self) -> tuple[str, str]:
        """Effect and target; intervals of one target are several places."""
        return self.effect, self.target if self.run is None else f"{self.target} {self.run} {self.shape}"

    def cause(self, amounts: Sequence[float]) -> Cause:
        """The cause at amplitudes (d,)."""
        values = {p.name: p.value(a * p.scale) for p, a in zip(self.parameters, amounts, strict=True)}
        own = public_values(self.module, {**self.shape, **values})
        return Cause(self.effect, self.module, self.target, {**nominal(self.module), **own})


@dataclass(frozen=True, eq=False, kw_only=True)
class DrivenAxis:
    """One run of one axis as the signal path sees it: mm or rad; lever: the study's mm per unit of the axis.

    weight, inertia (n,): load of the stated masses on the drive, N or N mm; 0 where none are stated. way (n,): of the axis,
    where it is known better than by its encoder, in the study's mm. temperature (n,): C, None where none is logged.
    stated_loads: as a `Motion` has them; None where no masses are stated.
    """

    run: AxisRun
    actuator: Actuator
    lever: float
    weight: Floats
    inertia: Floats
    way: Floats | None = None
    temperature: Floats | None = None
    stated_loads: Callable[[Motion, Floats], tuple[Floats, Floats]] | None = None

    @cached_property
    def asked(self) -> Motion:
        """The motion of the set-points of the whole log, with instants between its rows."""
        time, way = self.run.asked
        return between_rows(self._motion(time, way / self.lever))

    @cached_property
    def moved(self) -> Motion:
        """The motion of the encoders, or the one that was determined from them; a play behind them gives way to the weight of
        stated masses.
        """
        plain = self._motion(self.run.time, (self.run.encoder if self.way is None else self.way) / self.lever)
        return replace(plain, held=lambda: self.weight[:, None]) if self.weight.any() else plain

    @property
    def read(self) -> Floats:
        """Encoders (n,) at the instants of `asked`, NaN between the rows."""
        time = self.asked.time
        return (
            np.where(np.isin(time, self.run.time), np.interp(time, self.run.time, self.run.encoder), np.nan)
            / self.lever
        )

    def channel(self, name: ChannelName, causes: Sequence[Cause]) -> Floats:
        """Effect of causes on a channel (n,), in the study's mm or N: set-point - encoder, load - encoder, drive force."""
        names = (self.actuator.name,)
        if name == "following":
            behind = self.lever * (self.expected - self.followed(causes))[:, 0]
            return np.asarray(np.interp(self.run.time, self.asked.time, behind), float)
        error, guided = signal_path.driven(causes, names, self.moved)
        if name == "force":
            effort = signal_path.drive_forces(causes, names, guided)
            return np.zeros(len(self.run.time)) if effort is None else np.asarray(effort[:, 0] / self.lever, float)
        softer = sum(self._compliance(cause) - self._compliance(None) for cause in causes)
        return np.asarray(self.lever * (error[:, 0] - softer * self.weight), float)

    @cached_property
    def expected(self) -> Floats:
        """Encoders (n, 1) by the machine file."""
        return self.followed(())

    def followed(self, causes: Sequence[Cause]) -> Floats:
        """Encoders (n, 1) behind causes of the control, on top of those that the machine file states."""
        every = signal_path.on_top(causes, self.run.stated)
        return signal_path.controlled(every, (self.actuator.name,), self.asked)

    def known(self, causes: Sequence[Cause]) -> Bools:
        """Rows (n,) in which causes of the control do not depend on how the axis moved before its log began."""
        start = np.full((1, 1), self.run.encoder[0] / self.lever)
        every = signal_path.on_top(causes, self.run.stated)
        unsure = depends_on_start(every, self.asked, start, np.full(1, self.lever))[:, 0]
        return np.asarray(np.interp(self.run.time, self.asked.time, unsure) == 0.0)

    def laws(self, texts: Sequence[str], causes: Sequence[Cause]) -> Floats:
        """Effect of formulas that deflect the loop behind causes on the following error (n, q), in the study's mm."""
        rows = DriveRows(self.asked, 0, followed=self.followed(causes))
        added = np.stack([parse(text, known_names("control"))(rows, rows.rows) for text in texts], axis=1)
        deflected = self.deflected(self.asked.time, added, causes)
        return -self.lever * np.stack([np.interp(self.run.time, self.asked.time, each) for each in deflected.T], axis=1)

    def load(self, time: Floats, way: Floats) -> Floats:
        """Load (n,) N mm of the stated masses on the drive of a joint that goes a way (n,), the study's mm; 0 where there are none."""
        rows = DriveRows(self._motion(time, way / self.lever), 0)
        return parse(LOAD, known_names("control"))(rows, rows.rows)

    def deflected(self, time: Floats, columns: Floats, causes: Sequence[Cause]) -> Floats:
        """Columns (n, q) at instants (n,) that deflect the loop, as it follows them."""
        loops = [cause for cause in signal_path.on_top(causes, self.run.stated) if not cause.uncorrectable]
        if not signal_path.acting(loops, "control"):
            return columns
        followed, out = partial(signal_path.controlled, loops, (self.actuator.name,)), []
        alone = followed(self.asked)
        for each in columns.T:
            pushed = replace(self.asked, encoder=self.asked.encoder + np.interp(self.asked.time, time, each)[:, None])
            out.append(np.interp(time, self.asked.time, (followed(pushed) - alone)[:, 0]))
        return np.stack(out, axis=1)

    def _compliance(self, cause: Cause | None) -> float:
        """Way of the drive per unit of its load."""
        stiffness = self.actuator.stiffness
        if cause is not None and cause.effect.__name__.endswith("drive_stiffness"):
            return 0.0 if stiffness is None else 1.0 / (stiffness * cause.values["factor"])
        more = cause.values.get("compliance_rad_per_Nmm", 0.0) if cause is not None else 0.0
        return (0.0 if stiffness is None else 1.0 / stiffness) + float(more)

    def _motion(self, time: Floats, way: Floats) -> Motion:
        position = way[:, None]
        speed = np.gradient(position, time, axis=0)
        first = (position[1:2] - position[:1]) / (time[1] - time[0])
        loads = MassLoads(self.inertia[:, None], np.zeros((len(time), 6)))
        plain = Motion(
            time=time, common=self.run.started + time, cut_min=np.zeros(len(time)), encoder=position,
            temperature=None if self.temperature is None else np.interp(time, self.run.time, self.temperature),
            speed=speed, direction=direction(position), home=np.array([self.actuator.home]),
            stiffness=np.array([np.inf if self.actuator.stiffness is None else self.actuator.stiffness]),
            names=(self.actuator.name,), masses=lambda: loads, stated_loads=self.stated_loads,
        )  # fmt: skip
        return replace(plain, seams=Seams(np.zeros(1, int), np.full(1, np.inf), first))


def depends_on_start(servo: Sequence[Cause], motion: Motion, start: Floats, levers: Floats) -> Bools:
    """Rows (n, m) whose predicted encoders depend on how the axes moved before the log began.

    start (1, m): first encoders; levers (m,): way in mm per unit of a coordinate.
    """
    late = signal_path.controlled(servo, motion.names, motion)
    others = [signal_path.controlled(servo, motion.names, replace(motion, seams=None)) - late]
    loops = [cause for cause in servo if "law" not in cause.values]
    if loops and len(motion.time) > 1:
        settled = signal_path.controlled(loops, motion.names, motion)
        others.append(signal_path.controlled(loops, motion.names, _begun(motion, start))[1:] - settled)
    return np.asarray(np.any([np.abs(each) > REPEATABILITY_MM / levers for each in others], axis=0))


def _begun(motion: Motion, start: Floats) -> Motion:
    """The motion with a row before it, at which the axes stand at positions (1, m)."""

    def held(values: Floats) -> Floats:
        return np.concatenate([values[:1], values])

    step = motion.time[1] - motion.time[0]
    time, common = (np.concatenate([each[:1] - step, each]) for each in (motion.time, motion.common))
    return replace(
        motion, time=time, common=common, cut_min=held(motion.cut_min), encoder=np.concatenate([start, motion.encoder]),
        speed=held(motion.speed), direction=held(motion.direction), seams=None,
        temperature=None if motion.temperature is None else held(motion.temperature),
    )  # fmt: skip


def candidates(
    robot: Robot | None,
    axes: Sequence[DrivenAxis],
    channel: ChannelName,
    without: Sequence[str],
    *,
    ahead: bool = False,
    turned: float = 0.0,
) -> list[AxisCause]:
    """Effects of the library, and of users, that may act on a channel of an axis, once for each shape.

    ahead: whether encoders are ahead of their set-points. turned: speed, mm/s or rad/s, up to which friction turns round in any
    form, so that Stribeck friction is not told from it.
    """
    actuator = axes[0].actuator
    found: list[AxisCause] = []
    for name, module in shelf.usable("effects", ("none", *ELSEWHERE, *without)):
        if module.TARGET not in ("actuator", "either") or (
            robot is not None and not applies(module, robot, actuator.name)
        ):
            continue
        if not _acts(name, module, axes[0], channel):
            continue
        own = signal_path.fitted_parameters(module, actuator.revolute)
        own = getattr(module, "FITTED_AHEAD", own) if ahead else own
        linear = tuple(p for p in own if not p.shape)
        shapes = _shapes(module, own, axes, channel)
        fits = [(shape, linear) for shape in shapes if linear]
        if channel == "force" and name == "friction":
            fits = _with_more_friction(fits, actuator.revolute, turned)
        for shape, fitted in fits:
            names = {p.name for p in fitted}
            found.append(
                AxisCause(
                    effect=name, module=module, target=actuator.name, parameters=fitted,
                    shape={key: value for key, value in shape.items() if key not in names},
                    ways=float(len(fits) * getattr(module, "GUESSED_FROM", 1)), least={STRIBECK[actuator.revolute][1]: turned},
                    steps=tuple(shape[p.name] / p.scale if p.name in shape else 1.0 for p in fitted),
                )
            )  # fmt: skip
    return found


def _with_more_friction(
    fits: Sequence[tuple[dict[str, float], tuple[Parameter, ...]]], hinge: bool, turned: float
) -> list[tuple[dict[str, float], tuple[Parameter, ...]]]:
    """Shapes and parameters of Coulomb friction by itself, with friction of the speed, and with Stribeck's in addition."""
    known = {p.name: p for p in shelf.load("effects", "friction").PARAMETERS}
    viscous, asymmetry = (known[name] for name in DRAG[hinge])
    more, slow = (known[name] for name in STRIBECK[hinge])
    out = [(shape, (*own, *drag)) for shape, own in fits for drag in ((), (viscous,), (viscous, asymmetry))]
    return out + [
        (shape | {slow.name: v}, (*own, viscous, more)) for shape, own in fits for v in slow.scan if v > turned
    ]


def _acts(name: str, module: Any, axis: DrivenAxis, channel: ChannelName) -> bool:
    if name in (
        "drive_stiffness",
        "gravity_compliance",
    ):  # a stated spring errs by its factor, any other one is left out
        stated = axis.actuator.stiffness is not None
        return channel == "behind" and bool(np.ptp(axis.weight) > 0.0) and stated is (name == "drive_stiffness")
    if name == "friction":  # what it winds up is play to a second encoder; its force shows in that of the drive
        return channel == "force"
    if name == "inertia":
        return channel == "behind" and axis.actuator.stiffness is not None and bool(np.ptp(axis.inertia) > 0.0)
    if channel == "force":
        return hasattr(module, "on_drive_force")
    return hasattr(module, "on_servo" if channel == "following" else "on_drive")


def _shapes(
    module: Any, own: Sequence[Parameter], axes: Sequence[DrivenAxis], channel: ChannelName
) -> list[dict[str, float]]:
    """Shapes to try: of a guess from the rows, or the values of a scan."""
    switches = {p.name: p.either for p in own if p.either}
    settings = [dict(zip(switches, values, strict=True)) for values in product(*switches.values())]
    if channel == "following" and hasattr(module, "guess"):
        runs = [(a.asked.time, a.asked.encoder[:, 0], a.read) for a in axes]
        guess = module.guess(runs, axes[0].actuator.revolute)
        return [{**each, **guess} for each in settings] if guess else []
    scanned = [p for p in own if p.scan]
    if any(p.placed or p.turns for p in scanned):
        return []
    if not scanned:
        return settings
    if len(scanned) != 1:
        return []
    ends = [a.moved.common[[0, -1]] for a in axes]
    longest = (
        np.ptp(np.concatenate(ends)) if scanned[0].unit in ("s", "min") else np.inf
    )  # a longer curve is a straight line
    return [{**each, scanned[0].name: value} for each in settings for value in scanned[0].scan if value <= longest]
