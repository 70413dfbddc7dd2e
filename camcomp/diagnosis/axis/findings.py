"""Runs of one axis, and its findings channel by channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from camcomp.diagnosis.axis.gate import AxisGate
from camcomp.diagnosis.axis.noise_floor import FAST_S, LEAST_SPIKE_MM, spikes
from camcomp.diagnosis.axis.terms import WIDE, AxisTravel, Ripple
from camcomp.diagnosis.model.noise import StatedDeviation
from camcomp.diagnosis.result.types import FoundCause, Law, LawPart
from camcomp.diagnosis.statistics.probability import EVEN
from camcomp.ground.datatypes import Bools, Floats
from camcomp.model.effect import Cause
from camcomp.model.seams import missing_rows
from camcomp.model.statics.arm import ARM_LENGTH

ROWS = 50  # below which a run says nothing
FIRST_MOVE_MM = 0.2  # after which friction has its sense


def lever_mm(revolute: bool) -> float:
    """Way in mm by which an axis is studied per unit of its coordinate: 1 of a slide, that at the end of an arm of a hinge."""
    return ARM_LENGTH if revolute else 1.0


@dataclass(frozen=True, eq=False, kw_only=True)
class AxisRun:
    """Log of one axis in one run: time (n,) s; setpoint, encoder mm; force N, each (n,), NaN where nothing was logged.

    row (n,): of the log, from 1. revolute: a hinge, whose
    way counts at the end of an arm of 1 m (`lever_mm`), in mm and N like that of a slide. started: s, on the clock common to all runs.
    seen (n,): rows of which somebody saw how fast the axis was; all, where it is not given. course: times and set-points of the
    whole log, (m,) each, of which these may be some rows. expected (n,): encoder minus set-point by the machine file's effects of
    the control, which are `stated`.
    load (n,): second encoder behind the gear, without what the machine file says of it; NaN where there is none.
    """

    name: str
    time: Floats
    setpoint: Floats
    encoder: Floats
    force: Floats
    row: np.ndarray | None = None
    revolute: bool = False
    started: float = 0.0
    seen: Bools | None = None
    course: tuple[Floats, Floats] | None = None
    expected: Floats | None = None
    stated: Sequence[Cause] = ()
    load: Floats | None = None

    @property
    def gap(self) -> Floats:
        """Expected minus measured encoder (n,)."""
        return self.setpoint - self.encoder + (0.0 if self.expected is None else self.expected)

    @property
    def numbers(self) -> np.ndarray:
        """Number (n,) of every row in its log, from 1."""
        return np.arange(1, len(self.time) + 1) if self.row is None else self.row

    @property
    def clear(self) -> Bools:
        """Rows (n,) of which somebody saw how fast the axis was."""
        return np.ones(len(self.time), bool) if self.seen is None else self.seen

    @property
    def asked(self) -> tuple[Floats, Floats]:
        """Times and set-points (m,) of the whole log."""
        return self.course or (self.time, self.setpoint)

    def without_spikes(self) -> tuple[AxisRun, np.ndarray]:
        """The run with neighbours in the place of rows that are no measurement, and these rows' numbers."""
        row = self.numbers
        off = np.zeros(len(self.time), bool)
        kept: dict[str, Floats] = {}
        if len(row) < 2:
            return self, row[:0]
        jump = LEAST_SPIKE_MM if float(np.median(np.diff(self.time))) > FAST_S else 0.0
        for name, least in (("setpoint", jump), ("encoder", jump), ("force", 0.0)):
            y = getattr(self, name)
            bad = spikes(y, least)
            if name == "encoder":  # while the axis moves it is the following error that shows them
                bad |= spikes(replace(self, setpoint=kept["setpoint"]).gap, least)
            good = np.isfinite(y) & ~bad
            kept[name] = np.where(bad, np.interp(self.time, self.time[good], y[good]), y) if bad.any() else y
            off |= bad
        clean = replace(self, setpoint=kept["setpoint"], encoder=kept["encoder"], force=kept["force"])
        return clean, row[off]

    def on_ticks(self) -> AxisRun:
        """The run with its rows evenly apart, where its positions say that they were taken so and its clock was read late or early."""
        if len(self.time) < ROWS:
            return self
        tick = np.concatenate([[0.0], np.cumsum(np.round(np.diff(self.time) / np.median(np.diff(self.time))))])
        slope, start = np.polyfit(tick, self.time, 1)
        off = self.time - (start + slope * tick)
        if np.abs(off).max() >= EVEN * slope or np.any(np.diff(tick) < 1.0):
            return self
        way = self.setpoint if np.isfinite(self.setpoint).all() and np.ptp(self.setpoint) > 0.0 else self.encoder
        read = way - np.gradient(way, self.time) * off  # where it was at the tick, if the clock is right
        fast = np.abs(np.diff(way))[2:-1]  # at rest no clock shows
        rough = [float(np.abs(np.diff(each, 4)) @ fast) for each in (way, read)]
        if rough[0] >= EVEN * rough[1]:
            return self
        return replace(self, time=self.time - off)

    def away_from_gaps(self) -> AxisRun:
        """The run with the rows next to missing ones masked, since their speed is unknown; unmasked where that would
        mask most rows.
        """
        gaps = np.flatnonzero(missing_rows(self.time))
        near = np.zeros(len(self.time), bool)
        for gap in gaps:
            near[max(gap + 1 - WIDE[0], 0) : gap + 1 + WIDE[0]] = True  # rows of a cubic across it
        if not near.any() or near.mean() > EVEN:
            return self
        return replace(self, seen=~near)

    def moved(self) -> Bools:
        """Rows (n,) from the first move on: which way friction held the axis before nobody knows. All where it stays."""
        away = np.abs(self.encoder - self.encoder[:1])
        if not away.max(initial=0.0) > FIRST_MOVE_MM:
            return np.ones(len(away), bool)
        return np.arange(len(away)) >= int(np.argmax(away > FIRST_MOVE_MM))

    def of(self, rows: Bools) -> AxisRun:
        """Some of the rows (n,)."""
        whole = replace(self, row=self.numbers, seen=self.clear, course=self.asked)
        columns: dict[str, Any] = {
            f.name: x[rows] for f in fields(whole) if isinstance(x := getattr(whole, f.name), np.ndarray)
        }
        return replace(whole, **columns)


@dataclass(frozen=True, eq=False, kw_only=True)
class ChannelRun:
    """One run of a channel, in the rows that count (n,). number: of the run among those that the channel has.

    whole: times and values of every row. gap (n,): values without the constant of the fitted runs and, where the run is
    judged only, without its disturbance forces. left (n,): residual.
    """

    name: str
    number: int
    fitted: bool
    move: AxisTravel
    whole: tuple[Floats, Floats]
    gap: Floats
    left: Floats

    def of(self, rows: Bools) -> ChannelRun:
        """Some of the rows (n,)."""
        return replace(self, move=self.move.of(rows), gap=self.gap[rows], left=self.left[rows])


@dataclass(eq=False, kw_only=True)
class AxisChannel:
    """One channel of one axis: its runs, the fitted ones first, and its noise floor. columns (n, k): of what was fitted.

    unmodelled: as its fit tells it (`ChannelFit`).
    """

    runs: list[ChannelRun]
    floor: float
    stated: bool
    columns: Floats
    gate: AxisGate
    unmodelled: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def fitted(self) -> list[ChannelRun]:
        """Runs that are fitted."""
        return [r for r in self.runs if r.fitted]

    @property
    def held(self) -> list[ChannelRun]:
        """Runs that are judged only."""
        return [r for r in self.runs if not r.fitted]

    @property
    def left(self) -> list[Floats]:
        """Residuals (n,) of the fitted runs."""
        return [r.left for r in self.fitted]

    @property
    def squares(self) -> tuple[float, float]:
        """Mean squares of the gap and of the residual, of runs that are judged only, where there are any."""
        some = self.held or self.fitted
        gap, left = (np.concatenate(each) for each in ([r.gap for r in some], [r.left for r in some]))
        return float(np.mean(gap**2)), float(np.mean(left**2))

    @property
    def rows(self) -> Floats:
        """Values of every row of the fitted runs, one run after the other."""
        return np.concatenate([r.whole[1] for r in self.fitted])

    def followed(self, runs: Sequence[AxisRun]) -> list[Floats]:
        """Positions (n,) of runs by the fit of a following error: encoders without its residual."""
        paths = [run.encoder.copy() for run in runs]
        for r in self.runs:
            paths[r.number][np.isin(runs[r.number].time, r.move.time)] += r.left
        return paths


@dataclass(eq=False, kw_only=True)
class AxisFindings:
    """Findings of one axis."""

    name: str
    stated: StatedDeviation
    revolute: bool = False
    wide: int = WIDE[0]
    causes: list[FoundCause] = field(default_factory=list)
    imitated: dict[str, float] = field(default_factory=dict)  # effect -> probability beside something unmodelled
    following: AxisChannel | None = None
    force: AxisChannel | None = None
    behind: AxisChannel | None = None
    ripple: Ripple | None = None
    unknown_in: list[tuple[str, float]] = field(default_factory=list)  # covariate kind, share
    unknown_chance: float = 0.0  # log10, the least of all that is unknown
    details: dict[str, Any] = field(default_factory=dict)
    law: Law | None = None
    laws: list[LawPart] = field(default_factory=list)  # of its following error, as the machine file has them

    @property
    def stated_mm(self) -> float | None:
        """Stated deviation of the encoder, in the study's mm."""
        rad = self.stated.encoder_rad
        return (None if rad is None else ARM_LENGTH * rad) if self.revolute else self.stated.encoder_mm

    @property
    def stated_N(self) -> float | None:
        """Stated deviation of the drive force, in the study's N."""
        torque = self.stated.force_Nmm
        return (None if torque is None else torque / ARM_LENGTH) if self.revolute else self.stated.force_N

    @property
    def channels(self) -> list[AxisChannel]:
        """Those that were studied."""
        return [c for c in (self.following, self.behind, self.force) if c is not None]

    @property
    def strange(self) -> bool:
        """Whether the residual shows an unmodelled effect."""
        return bool(self.ripple or self.unknown_in or any(c.gate.above for c in self.channels))
