"""Static poses of an arm on the bench: where its tip should have been, and how every effect would move it.

The same hooks act in the same order as for a program; what depends on motion sees none. Frame of the tracker and
place of its target are found per campaign and are nuisances: behind them nothing is left for hooks of workpiece and
sensor to say. Nothing cuts, so the drives push nothing but the load.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache, partial
from itertools import pairwise
from typing import Any

import numpy as np

from camcomp.diagnosis.arm.registration import Registration, nuisance_columns, register
from camcomp.diagnosis.fit.bench import SHARE_OF_SCALE
from camcomp.diagnosis.model.group import Group
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats
from camcomp.model import signal_path
from camcomp.model.axes import slides_of
from camcomp.model.effect import Cause, Load, Motion, Parameter, applies, nominal, public_values
from camcomp.model.law.covariates import loads_along
from camcomp.model.statics.arm import ARM_LENGTH, Arm, arm_of
from camcomp.model.statics.description import Actuator, Link, Robot
from camcomp.model.statics.hanging import Hung, grown_way, hang, tool_wrench
from camcomp.model.statics.masses import mass_loads

_SAME_STEP = 1e-6  # times in equal steps of 1 are row numbers
_JOINT_STEP = 1e-5  # rad or mm
CURVE = "joint_curve"
LEAST_POSES = 4  # of a campaign, with three values each: its frame and target have nine unknowns
EffectShape = tuple[
    tuple[str, float, float, float], ...
]  # what shapes an effect: name, value, and between which values it lies
_WRIST = {"joint_coupling": 2}  # effects of the last joints only: of how many
_SLIDES = ("backlash",)  # effects of slides only: what a standing hinge has of it is joint_hysteresis
# Effects of these hooks stand still, or are part of the registration.
_UNSEEN = (
    "time_sync", "workpiece_frame", "tool_length", "chain_error", "servo_lag", "friction", "inertia", "none",
)  # fmt: skip


@dataclass(frozen=True, eq=False, kw_only=True)
class Poses:
    """Poses of one campaign: joints q (n, m), measured tips (n, 3) mm, time (n,) s, temperature (n,) or None, run (n,).

    sd (n, 3) mm: as stated by the instrument, NaN or None where it states none; row (n,): of the run's log, from 1;
    approach (n, m): direction in which every joint turned last, +1 or -1, 0 where unknown; torque (n, m) of the drives as
    logged, N mm or N, NaN or None where there is none; force (n, 3) N on the tool as a dynamometer measured it, machine
    frame, None without one.
    """

    label: str
    q: Floats
    tip: Floats
    time: Floats
    temperature: Floats | None
    run: np.ndarray
    sd: Floats | None = None
    row: np.ndarray | None = None
    approach: Floats | None = None
    torque: Floats | None = None
    force: Floats | None = None

    def take(self, rows: np.ndarray) -> Poses:
        """The poses of a mask or of indices."""
        whole = replace(self, row=self.rows)
        own: dict[str, Any] = {f.name: getattr(whole, f.name) for f in fields(whole) if f.name != "label"}
        return replace(whole, **{name: each[rows] for name, each in own.items() if each is not None})

    @staticmethod
    def together(runs: Sequence[Poses]) -> Poses:
        """Poses of runs of one campaign, one after the other, in order of their joints and without a row twice.

        A temperature has to be known in all runs; what else only some runs have is unknown (0 for approach and force) in
        the others.
        """
        blank = {"sd": np.nan, "torque": np.nan, "approach": 0.0, "force": 0.0, "temperature": np.nan}
        out: dict[str, Any] = {"row": np.concatenate([r.rows for r in runs])}
        for name in ("q", "tip", "time", "run", *blank):
            parts = [getattr(r, name) for r in runs]
            if all(each is None for each in parts) or (name == "temperature" and any(each is None for each in parts)):
                continue
            width = {"approach": runs[0].q.shape[1], "torque": runs[0].q.shape[1]}.get(name, 3)
            filled = [
                np.full((len(r.q), width), blank[name]) if p is None else p for r, p in zip(runs, parts, strict=True)
            ]
            out[name] = np.concatenate(filled)
        every = Poses(label=runs[0].label, **{"temperature": None, **out})
        return every.take(np.unique(np.concatenate([every.q, every.tip], axis=1), axis=0, return_index=True)[1])

    @property
    def rows(self) -> np.ndarray:
        """Row (n,) of every pose in the log of its run, from 1."""
        return np.arange(1, len(self.q) + 1) if self.row is None else self.row

    @property
    def has_clock(self) -> bool:
        """Whether times are more than row numbers."""
        steps = np.diff(np.sort(self.time))
        return bool(len(steps)) and bool(np.ptp(steps) > _SAME_STEP * max(float(np.abs(steps).max()), 1e-300))

    @property
    def order(self) -> Floats:
        """Order (n,) of the poses in time, 0 to 1."""
        out = np.empty(len(self.q))
        out[np.argsort(self.time, kind="stable")] = (np.arange(len(out)) + 0.5) / len(out)
        return out


@dataclass(frozen=True)
class Column:
    """One parameter of an effect at a target, fitted in units of its scale.

    shape: what shapes it, where something does: name, value, and between which values it lies.
    """

    effect: str
    target: str | None
    module: Any
    parameter: Parameter
    shape: EffectShape = ()

    def cause(self, amount: float) -> Cause:
        """The cause with this parameter at an amplitude."""
        p = self.parameter
        values = {**{name: value for name, value, _, _ in self.shape}, p.name: p.value(amount * p.scale)}
        return Cause(self.effect, self.module, self.target, values)


@dataclass(frozen=True, eq=False, kw_only=True)
class LoadedArm:
    """An arm that stands in poses with causes on it: where its platform hangs, and what the tool behind it is told."""

    hung: Hung
    causes: tuple[Cause, ...]
    load: Load
    motion: Motion
    robot: Robot
    origin: Floats

    def tips(self, at: Registration) -> Floats:
        """Tips (n, 3) in the machine frame, without the nuisances of a registration."""
        tip = at.tips(self.hung.point, self.hung.rotation)
        tip = signal_path.led(self.causes, tip, self.motion, self.robot, self.origin)
        return signal_path.posed(self.causes, tip, self.load, self.motion)


@dataclass(eq=False, kw_only=True)
class ArmBench:
    """An arm's model and its campaigns, the first `fitted` of which are fitted (None: all); the others are judged.

    start: first registration of every campaign; owner: of every campaign, the one whose frames it has. A judged campaign
    has those of the fitted one with its label, else its own. origin (3,): of the program, machine frame, mm.
    """

    robot: Robot
    causes: tuple[Cause, ...]
    campaigns: list[Poses]
    fitted: int | None = None
    start: list[Registration] = field(default_factory=list)
    owner: list[int] = field(default_factory=list)
    origin: Floats = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        self.arm: Arm = _need(arm_of(self.robot))
        self.fitted = len(self.campaigns) if self.fitted is None else self.fitted
        labels = [each.label for each in self.campaigns]
        for k, each in enumerate(self.campaigns):
            own = labels.index(each.label)
            self.owner.append(own if own < self.fitted else k)
            if self.owner[k] < k:
                self.start.append(self.start[self.owner[k]])
                continue
            hung = self.standing(each, ()).hung
            self.start.append(register(each.tip, hung.point, hung.rotation, self.robot.tool))

    def having(self, campaigns: Sequence[Poses], fitted: int | None = None) -> ArmBench:
        """The same arm with other campaigns."""
        return ArmBench(robot=self.robot, causes=self.causes, campaigns=[*campaigns], fitted=fitted, origin=self.origin)

    @property
    def own(self) -> tuple[int, ...]:
        """Numbers of the campaigns that are fitted."""
        return tuple(range(self.fitted or 0))

    @property
    def actuators(self) -> tuple[str, ...]:
        """Names in order."""
        return tuple(a.name for a in self.robot.actuators)

    def standing(self, campaign: Poses, causes: Sequence[Cause]) -> LoadedArm:
        """A campaign with causes on top of those of the config."""
        causes = [complete(cause) for cause in (*self.causes, *causes)]
        robot, _ = signal_path.edited(causes, self.actuators, self.robot)
        motion = _standing(robot, campaign)
        motion = replace(motion, encoder=signal_path.controlled(causes, self.actuators, motion))
        error, _ = signal_path.driven(causes, self.actuators, motion)
        force = np.zeros((len(campaign.q), 3)) if campaign.force is None else campaign.force
        load = signal_path.loaded(causes, replace(motion, measured_force=True), force)
        q = motion.encoder + error
        wrench = load.wrench + tool_wrench(robot, q, load.force)
        hung = hang(robot, q, wrench if wrench.any() else None, campaign.torque)
        grown = signal_path.grown(causes, self.actuators, motion)
        if grown is not None:
            hung = replace(hung, point=hung.point + grown_way(robot, q, grown))
        return LoadedArm(hung=hung, causes=tuple(causes), load=load, motion=motion, robot=robot, origin=self.origin)

    def columns(self, without: Sequence[str] = ()) -> list[Column]:
        """Every parameter of the shelf that may move a standing arm, once for each shape of effects of drives and links."""
        timed = self._warm or all(
            each.has_clock for each in self.campaigns
        )  # rows without a clock have no warming curve
        found: list[Column] = []
        for name, module in shelf.usable("effects", (*_UNSEEN, *without)):
            for target in self._targets(name, module):
                own = getattr(module, "SOUGHT", {}).get(target)
                if own is None:
                    one = self.drive(target if target in self.actuators else self.actuators[0])
                    own = signal_path.fitted_parameters(module, one.revolute)
                shapes: list[EffectShape] = [()]
                if scanned := any(p.scan for p in own):
                    of_arm = hasattr(module, "on_drive") or hasattr(module, "on_links")
                    shapes = _shapes(own, self._warm) if timed and of_arm else []
                found += [Column(name, target, module, p, s) for s in shapes for p in own if not (scanned and p.shape)]
        return found

    def _targets(self, name: str, module: Any) -> list[str | None]:
        """Where an effect may act: on this arm, or on a machine whose slides X, Y, Z carry each other."""
        stiff = any(a.stiffness is not None for a in self.robot.actuators)
        missing = name == "drive_stiffness" and not stiff
        missing |= name == "link_stiffness" and not any(isinstance(e, Link) for e in self.arm.chain.elements)
        slides = [not a.revolute for a in self.robot.actuators]
        if missing or (getattr(module, "ARM_ONLY", False) and all(slides)):
            return []
        if module.TARGET == "named":
            square = {axis for axis, _, _ in slides_of(self.robot)} == {0, 1, 2}
            return list(getattr(module, "SOUGHT", module.TARGETS)) if square else []
        common = module.TARGET == "machine" or (module.TARGET == "either" and any(p.scan for p in module.PARAMETERS))
        targets: list[str | None] = [None] if common else []
        targets += [] if module.TARGET == "machine" else list(self.actuators)[-_WRIST.get(name, 0) :]
        if name in _SLIDES:
            targets = [each for each, slide in zip(self.actuators, slides, strict=True) if slide]
        return [each for each in targets if applies(module, self.robot, each)]

    @property
    def _warm(self) -> bool:
        """Whether temperatures of all campaigns are known, so that no time of warming up is."""
        return all(each.temperature is not None for each in self.campaigns)

    def drive(self, name: str) -> Actuator:
        """The actuator called `name`."""
        return next(a for a in self.robot.actuators if a.name == name)

    def features(self, campaign: Poses) -> Floats:
        """Features (n, 2 m) that measure how similar two postures are: sine and cosine of a hinge; a slide counts by its share
        of ARM_LENGTH.
        """
        hinge, q = np.array([a.revolute for a in self.robot.actuators]), campaign.q
        return np.concatenate([np.where(hinge, np.sin(q), q / ARM_LENGTH), np.where(hinge, np.cos(q), 0.0)], axis=1)

    def groups(self, columns: Sequence[Column], sd: float, at: Mapping[int, float] | None = None) -> list[Group]:
        """Linearised rows of every campaign at amplitudes `at` (index of column -> amount); sd: noise, mm per coordinate."""
        amounts = dict(at or {})
        causes = combined(columns, amounts)
        out = []
        for k, campaign in enumerate(self.campaigns):
            owner, (frame, stood) = self.owner[k], self.registered(k, causes)
            here = stood.tips(frame)
            X = self._motion(campaign, columns, amounts, frame, here)
            left = frame.to_machine(campaign.tip) - here
            for j, amount in amounts.items():
                left = left + X[:, :, j] * amount
            about = self.start[owner].to_machine(self.campaigns[owner].tip).mean(axis=0)
            N = nuisance_columns(here, stood.hung.rotation, about)
            clock = campaign.order if campaign.has_clock else None
            noise = np.full(left.shape, sd)
            out.append(
                Group(
                    name=f"{campaign.run[0]}", label=owner, y=left, A=X, N=N, sd=noise,
                    position=self.features(campaign), order=clock,
                )
            )  # fmt: skip
        return out

    def _motion(
        self,
        campaign: Poses,
        columns: Sequence[Column],
        amounts: Mapping[int, float],
        frame: Registration,
        here: Floats,
    ) -> Floats:
        """Motion (n, 3, k) of tips per unit of every column; those of drives by the motion of joints."""
        causes = combined(columns, amounts)
        joints = self.joint_motion(campaign, causes, frame)
        X = np.empty((*here.shape, len(columns)))
        for j, column in enumerate(columns):
            module = column.module
            if column.effect == CURVE:
                a = self.actuators.index(str(column.target))
                X[:, :, j] = joints[:, :, a] * wave(column, campaign.q[:, a])[:, None]
            elif signal_path.stages_of(module) == {"drive"} and not signal_path.pushes(module) and j not in amounts:
                cause = complete(column.cause(1.0))
                error, _ = signal_path.driven([cause], self.actuators, _standing(self.robot, campaign))
                X[:, :, j] = np.einsum("nim,nm->ni", joints, error)
            else:
                moved = combined(columns, {**amounts, j: amounts.get(j, 0.0) + SHARE_OF_SCALE})
                if column.shape and j not in amounts:  # another shape of the same place may act
                    moved = [*causes, *combined(columns, {j: SHARE_OF_SCALE})]
                X[:, :, j] = (self.standing(campaign, moved).tips(frame) - here) / SHARE_OF_SCALE
        return X

    def joint_motion(self, poses: Poses, causes: Sequence[Cause], at: Registration) -> Floats:
        """Motion (n, 3, m) of tips, machine frame, mm per rad (mm) by which a joint stands off its encoder."""
        here = self.standing(poses, causes).tips(at)
        step = _JOINT_STEP * np.eye(len(self.actuators))
        moved = [self.standing(replace(poses, q=poses.q + each), causes).tips(at) - here for each in step]
        return np.stack(moved, axis=2) / _JOINT_STEP

    def registered(self, k: int, causes: Sequence[Cause]) -> tuple[Registration, LoadedArm]:
        """Campaign k with causes, and the frame and tool vector that fit best to it, or to the fitted one that it shares them with."""
        owner = self.owner[k]
        stood = self.standing(self.campaigns[owner], causes)
        at = self.start[owner].fitted(self.campaigns[owner].tip, stood.tips, stood.hung.rotation)
        return at, stood if owner == k else self.standing(self.campaigns[k], causes)

    def gap(self, k: int, causes: Sequence[Cause]) -> Floats:
        """Measured minus modelled tips (n, 3) of campaign k, machine frame, in the frame that fits best."""
        at, stood = self.registered(k, causes)
        return at.to_machine(self.campaigns[k].tip) - stood.tips(at)


def combined(columns: Sequence[Column], amounts: Mapping[int, float]) -> list[Cause]:
    """Causes at amplitudes by column index; parameters of one effect and target make one cause."""
    merged: dict[tuple[str, str | None], Cause] = {}
    for j, amount in amounts.items():
        if amount == 0.0:
            continue
        column = columns[j]
        one, key = column.cause(amount), (column.effect, column.target)
        values = {**merged[key].values, **one.values} if key in merged else one.values
        merged[key] = replace(one, values=values)
    return [replace(c, values=public_values(c.effect, c.values)) for c in merged.values()]


def wave(column: Column, angle: Floats) -> Floats:
    """A wave (n,) of a joint over its angle (n,), rad, in units of its scale."""
    name, order, _ = column.parameter.name.split("_")
    turn = np.sin if name == "sine" else np.cos
    return np.asarray(column.parameter.scale * turn(int(order) * angle), float)


def approached(q: Floats, time: Floats, least: float = 1e-4) -> Floats:
    """Way (n, m), +1 or -1, in which joints q (n, m) turned last when a log stopped in them; 0 where it does not show.

    Taken as straight from row to row; reversals below `least` rad (mm) are ignored. Rows without an order have none.
    """
    out = np.zeros_like(q)
    order = np.argsort(time, kind="stable")
    if len(time) < 2 or not np.ptp(time) > 0.0:
        return out
    way = np.zeros(q.shape[1])
    for before, row in pairwise(order):
        step = q[row] - q[before]
        way = np.where(np.abs(step) > least, np.sign(step), way)
        out[row] = way
    return out


def _shapes(parameters: Sequence[Parameter], warm: bool) -> list[EffectShape]:
    """Shapes to try of an effect: times of warming up, or nothing where temperatures are logged; no shape of what is placed."""
    scanned = [p for p in parameters if p.scan]
    if len(scanned) != 1 or scanned[0].placed or scanned[0].turns:
        return []
    one = scanned[0]
    if warm:
        return [()]
    ends = (one.low, *one.scan, one.high)
    return [((one.name, ends[k], ends[k - 1], ends[k + 1]),) for k in range(1, len(ends) - 1)]


def complete(cause: Cause) -> Cause:
    """The cause with all of its parameters, nominal where none is given."""
    return replace(cause, values={**nominal(cause.effect), **cause.values})


def _standing(robot: Robot, campaign: Poses) -> Motion:
    """The motion of poses that do not move."""
    zero = np.zeros_like(campaign.q)
    home, worn = np.array([a.home for a in robot.actuators]), np.zeros(len(campaign.q))
    way = zero if campaign.approach is None else campaign.approach
    return Motion(
        time=campaign.time, common=campaign.time, cut_min=worn, temperature=campaign.temperature, encoder=campaign.q,
        speed=zero, direction=way, came=way, home=home, stiffness=signal_path.springs(robot), ordered=False,
        masses=cache(partial(mass_loads, robot, campaign.q)),
        held=cache(lambda: hang(robot, campaign.q, None, campaign.torque).drive),
        stated_loads=partial(loads_along, robot),
    )  # fmt: skip


def _need(arm: Arm | None) -> Arm:
    if arm is None:
        raise ValueError("not an arm: several chains, or joints without a drive")
    return arm
