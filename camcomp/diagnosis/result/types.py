"""Types of the result of a diagnosis, key by key, common to programs, poses of arms and logs of axes.

All keys are always present; those that do not apply to a study are empty or null.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, PrivateAttr

from camcomp.diagnosis.result.standards import StandardValues
from camcomp.ground.datatypes import Floats
from camcomp.ground.result import Result

Stage = Literal["control", "drive", "structure", "process", "tool", "workpiece", "sensor"]
Share = float  # of the gap's energy, 0 to 1
Pair = Annotated[tuple[float, float], Field(description="low and high end")]
UNKNOWN: Literal["unknown"] = "unknown"
MOST_LISTED = 8  # minor effects, or drivers of a gap


def six_digits(value: float) -> float:
    """A value as results state it, to six digits."""
    return float(f"{value:.6g}")


class ActuatorGap(Result):
    """Size of an actuator's error (rms) and of its noise, in its own unit."""

    rms: float
    floor: float
    unit: Literal["um", "urad"]


class ActuatorShrinkage(Result):
    """Size of an actuator's error (rms) on unseen runs, in its own unit."""

    before_rms: float
    after_rms: float
    unit: Literal["um", "urad"]


class GapSize(Result):
    """Size of the gap over all runs at the tip, um, and of its noise; for logs without a tip also by actuator."""

    rms_um: float
    p95_um: float
    max_um: float
    noise_floor_um: Annotated[float | None, Field(description="null where nothing tells it")]
    actuators: dict[str, ActuatorGap] = Field(default_factory=dict)

    @classmethod
    def of(cls, size: Floats, floor: float | None, **more: Any) -> GapSize:
        """Of distances (n,) and their noise floor, um. more: other fields."""
        figures = np.sqrt(np.mean(size**2)), np.quantile(size, 0.95), size.max()
        rms, p95, most = (round(float(each), 3) for each in figures)
        noise = None if floor is None else round(floor, 3)
        return cls(rms_um=rms, p95_um=p95, max_um=most, noise_floor_um=noise, **more)

    @property
    def at_actuators_alone(self) -> bool:
        """Whether no error of an actuator moves the tip, as where it lies on the axis of the last hinge of an arm."""
        return self.noise_floor_um == 0.0 and bool(self.actuators)


class LineShare(Result):
    """A source line of a run with a gap above the noise."""

    run: str
    line: int
    share: Share
    rms_um: float


class IntervalShare(Result):
    """An interval of time of a run with a gap above the noise."""

    run: str
    t0_s: float
    t1_s: float
    share: Share


class Driver(Result):
    """A covariate of the gap; with an unknown cause, of the residual."""

    covariate: str
    share: Share


class RippleDriver(Driver):
    """A line over position in the drive force: its period, and its amplitude in both directions and in each."""

    channel: str
    period_mm: float
    amplitude_N: float
    forward_N: float
    backward_N: float


class FrequencyLine(Result):
    """A line of the gap's spectrum over time."""

    axis: str
    hertz: float
    amplitude_um: float
    share: Share


class Where(Result):
    """Stage at which the gap arises, and its distribution over axes, lines and times."""

    stage: Stage
    axes: dict[str, Share]
    actuators: dict[str, Share]
    lines: tuple[LineShare, ...] = ()
    intervals: tuple[IntervalShare, ...] = ()
    drivers: tuple[RippleDriver | Driver, ...] = ()
    frequencies: tuple[FrequencyLine, ...] = ()


class NamedCause(Result):
    """An effect at its target, null where it has none."""

    effect: str
    target: str | None

    @property
    def label(self) -> str:
        """`effect (target)`."""
        return f"{self.effect} ({self.target})" if self.target else self.effect


SOMETHING_UNKNOWN = NamedCause(effect=UNKNOWN, target=None)


def alternatives_of(
    known: Sequence[NamedCause], others: Sequence[tuple[NamedCause, ...]] = ()
) -> tuple[tuple[NamedCause, ...], ...]:
    """Sets that explain alike, the best one first; a lone set has itself plus something unknown as its rival."""
    return (tuple(known), *(others or [(*known, SOMETHING_UNKNOWN)]))


class Estimate(Result):
    """A value with its 95 % interval."""

    value: float
    ci95: Pair

    @classmethod
    def stated(cls, value: float, low: float, high: float) -> Estimate:
        """The estimate to six digits, with an interval that holds the value, whichever end is the low one."""
        low, value, high = (six_digits(each) for each in (low, value, high))
        return cls(value=value, ci95=(min(low, value, high), max(low, value, high)))


class FoundCause(NamedCause):
    """A cause: its probability, share of the gap, and parameters."""

    probability: Annotated[float, Field(ge=0.0, le=1.0)]
    share: Share
    parameters: dict[str, Estimate] = Field(default_factory=dict)

    @property
    def named(self) -> NamedCause:
        """Its effect and target."""
        return NamedCause(effect=self.effect, target=self.target)

    @property
    def settings(self) -> dict[str, Any]:
        """Further keys of its entry in a machine file."""
        return {}


class ErrorCurve(Result):
    """The error of a joint over its angle, with its deviation, and the measured ranges."""

    angle_deg: tuple[float, ...]
    error_rad: Annotated[tuple[float, ...], Field(description="as it is taken out: 0 where nothing was seen")]
    sd_rad: Annotated[tuple[float, ...], Field(description="one deviation; wide where nothing was seen")]
    seen_deg: tuple[Pair, ...]
    seen_share: Annotated[float, Field(description="of a turn")]


class CurveCause(FoundCause):
    """The error curve of a joint."""

    curve: ErrorCurve
    _settings: dict[str, Any] = PrivateAttr(default_factory=dict)

    @property
    def settings(self) -> dict[str, Any]:
        """Shape of the curve as YAML keys."""
        return self._settings


class LawTerm(Result):
    """A term of a law, with its coefficient."""

    term: str
    value: float
    ci95: Pair
    unit: str


class LawPart(Result):
    """An effect `formula` or `map` for a part of a law, with the keys of a machine file."""

    effect: Literal["formula", "map"]
    stage: Stage
    target: str | None
    axis: str | None
    envelope: dict[str, Pair]
    formula: str | None = None
    over: tuple[str, ...] | None = None
    coefficients_mm: tuple[float, ...] | tuple[tuple[float, ...], ...] | None = None


class Law(Result):
    """Law of an unknown cause, with the envelope of its data."""

    formula: str
    on: Stage
    terms: tuple[LawTerm, ...]
    envelope: dict[str, Pair]
    after_rms_um: Annotated[float, Field(description="of the gap on parts of the data that it was not fitted to")]
    before_rms_um: Annotated[float, Field(description="the same without it")] = 0.0
    kind: Literal["formula", "map"] = "formula"
    says: str = ""
    alike: Annotated[tuple[str, ...], Field(description="terms that these data cannot tell from those found")] = ()
    parts: Annotated[tuple[LawPart, ...], Field(description="what puts it to work in a machine file")] = ()


class UnknownCause(FoundCause):
    """The model discrepancy that the library does not explain."""

    effect: Literal["unknown"] = UNKNOWN
    law: Law | None = None


class ShrinkageStep(NamedCause):
    """Residual on withheld runs with this cause added."""

    after_rms_um: float


class UnseenShrinkage(Result):
    """Shrinkage of the gap on withheld runs or campaigns."""

    holdout: tuple[str, ...]
    before_rms_um: float
    after_rms_um: float
    ratio: float
    ci95: Pair
    steps: tuple[ShrinkageStep, ...] = ()
    noise_floor_um: float | None = None
    covered_share: Annotated[
        float | None, Field(description="of unseen poses of an arm: every joint at angles its error curve was seen at")
    ] = None
    actuators: dict[str, ActuatorShrinkage] = Field(default_factory=dict)
    covered_rms_um: Annotated[float | None, Field(description="left on these")] = None
    refitted: Annotated[tuple[str, ...], Field(description="what only the unseen runs themselves can tell")] = ()


class PosesToMeasure(Result):
    """Poses of an arm in the order of measuring: joints by name, rad (mm), and platform position, machine frame."""

    joints: tuple[str, ...]
    positions: tuple[tuple[float, ...], ...]
    platform_mm: tuple[tuple[float, float, float], ...]


class StrokeBlock(Result):
    """Strokes of one axis: end positions, speed, and number of cycles."""

    low: float
    high: float
    speed: Annotated[float, Field(description="unit per second")]
    times: int


class AxisMoves(Result):
    """Strokes of one axis alone in consecutive blocks, each from standstill to standstill."""

    axis: str
    unit: Literal["mm", "rad"]
    blocks: tuple[StrokeBlock, ...]
    acceleration: Annotated[float, Field(description="unit per second squared")]
    step_s: float


class NextExperiment(Result):
    """The next experiment: effects that it separates, expected gain, and duration."""

    action: str
    separates: tuple[str, ...]
    gain: Annotated[float, Field(description="expected information, bits")]
    minutes: float | None = None
    outcomes: Annotated[tuple[str, ...], Field(description="what each outcome would mean, a sentence each")] = ()
    poses: Annotated[
        PosesToMeasure | None, Field(description="studies of arms: the list that --next-program writes")
    ] = None
    moves: Annotated[AxisMoves | None, Field(description="studies of axes: whose set-points --next-program writes")] = (
        None
    )


class MinorEffect(NamedCause):
    """A minor effect, of the size of healthy machines."""

    size_um: float


class Floor(Result):
    """Noise floor of the gap (null if unknown), and its source."""

    um: float | None
    source: Literal["repeats", "rest", "stated", "rows", "not identifiable"]


class Outlier(Result):
    """An excluded row of a run's log, from 1."""

    run: str
    row: int


class DiagnosisResult(Result):
    """The result file of `camcomp diagnose`."""

    INDENT: ClassVar[int] = 1

    verdict: Literal["none", "identified", "ambiguous", "unknown"]
    gap: GapSize
    where: Where
    causes: tuple[UnknownCause | CurveCause | FoundCause, ...]
    alternatives: tuple[tuple[NamedCause, ...], ...] = ()
    shrinkage: UnseenShrinkage | None
    next_experiment: NextExperiment | None = None
    minor: tuple[MinorEffect, ...] = ()
    floor: Floor
    outliers: tuple[Outlier, ...] = ()
    equivalent: Annotated[
        tuple[tuple[NamedCause, ...], ...], Field(description="causes that these runs cannot tell apart")
    ] = ()
    axis_laws: Annotated[
        tuple[LawPart, ...],
        Field(description="acceleration, friction, weight and constant of following errors, for the machine file"),
    ] = ()
    axes_in_detail: dict[str, dict[str, Any]] = Field(default_factory=dict, description="studies of axes: every fit")
    standards: Annotated[StandardValues, Field(description="ISO 230-2, ISO 230-4 and ISO 9283")] = StandardValues()

    @property
    def law(self) -> Law | None:
        """The law of the unknown cause, or None."""
        return next((each.law for each in self.causes if isinstance(each, UnknownCause)), None)

    @property
    def known(self) -> tuple[FoundCause, ...]:
        """The causes from the library."""
        return tuple(each for each in self.causes if not isinstance(each, UnknownCause))
