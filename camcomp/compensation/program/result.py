"""The figures of a compensation and of a verification as types: what `--summary` and `verify --json` write."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict, Field

from camcomp.compensation.bands.outcome import BandShare, ExpectedError, TakenCorrection
from camcomp.ground.datatypes import Floats
from camcomp.ground.result import Result, Size
from camcomp.ground.vectors import chosen, sizes
from camcomp.model.cutting.assumed import Engagement, assumed_force
from camcomp.model.job import Job

WORSE_SHARE = 0.01  # by which the largest error may grow (contract, section 4)


class Figures(Result):
    """Base of figures some of which are only stated where they exist: keys that were not set are omitted in JSON."""

    model_config = ConfigDict(json_schema_serialization_defaults_required=False)

    def as_json(self) -> dict[str, Any]:
        """The result as a mapping of JSON types."""
        return self.model_dump(mode="json", exclude_unset=True)


class ErrorSize(Result):
    """Distance of the loaded tip from the programmed one."""

    rms_um: Size
    max_um: Size


class ErrorSum:
    """Sum of squares, count and largest size of errors."""

    def __init__(self) -> None:
        self.most_um, self._squares, self._count = 0.0, 0.0, 0

    def add(self, error: Floats) -> float:
        """Add errors (k, 3) mm; NaN rows are ignored. Returns the largest size, um."""
        size = 1e3 * sizes(error)
        size = chosen(size, np.isfinite(size))
        self._squares, self._count = self._squares + float(np.sum(size**2)), self._count + len(size)
        most = float(size.max(initial=0.0))
        self.most_um = max(self.most_um, most)
        return most

    def figures(self) -> ErrorSize:
        """RMS and largest size."""
        return ErrorSize.model_construct(
            rms_um=float(np.sqrt(self._squares / max(self._count, 1))), max_um=self.most_um
        )


def worse_than_before(before_um: float, after_um: float, step_mm: float) -> list[tuple[str, str]]:
    """The failed check, rule id and text, of a program whose largest error has grown; steps of step_mm are its rounding."""
    allowed = max((1.0 + WORSE_SHARE) * before_um, before_um + 1e3 * np.sqrt(3.0) * step_mm)
    if after_um <= allowed:
        return []
    text = (
        f"the largest error grows from {before_um:.3f} um to {after_um:.3f} um; the original program is the better one"
    )
    return [("CC609", text)]


class CycleTime(Result):
    """Time that the control takes for a program: its moves as they are modelled, G4, and M6 by control.tool_change_s.

    Spindle, coolant and stops (M0, M1) take none.
    """

    before: float
    after: float


BOUND_UM = 0.05  # no interpolated point may differ by more from its exact solution


class Interpolation(Result):
    """Of a long program: how many points were solved exactly, and how far a sample is from its exact solution."""

    bound_um: float
    checked: int
    worst_um: Size
    worst_drive_force: Size
    tiles: int
    exact_solutions: int


def interpolation_failed(found: Interpolation | None) -> list[tuple[str, str]]:
    """CC607 and its text where a sample of the program is too far from its exact solutions."""
    if found is None or found.worst_um <= BOUND_UM:
        return []
    return [("CC607", f"{found.worst_um:.3f} um between interpolated and exact points, more than {BOUND_UM:g} um")]


class Force(Result):
    """Which cutting force was assumed."""

    model: Annotated[str, Field(description="force model of the machine file")]
    engagement: Annotated[
        Engagement,
        Field(description="stock: by the stock; stated: as the machine file writes it; none: on every feed move"),
    ]
    text: str


def job_figures(job: Job) -> dict[str, Any]:
    """Figures of the job for a summary: the assumed force, and the statements in the program's comments."""
    force = assumed_force(job.config)
    said = {"stated_in_program": job.taken.said} if job.taken.said else {}
    return {"force": Force.model_construct(model=force.model, engagement=force.engagement, text=force.text), **said}


_CONTROL_ADDS = "with the contour error of the controller, also next to joining lines; errors that the policy accepts are subtracted"
# Figures that a compensation and a verification share.
ControlMode = Annotated[
    str, Field(description="path modes in which the program cuts: G61, G61.1, G64 with P and Q in mm")
]
ControlModeStated = Annotated[bool, Field(description="by the program or the machine file; else it is assumed")]
Taken = Annotated[TakenCorrection | None, Field(description="with a policy other than full")]
Expected = Annotated[ExpectedError | None, Field(description="with uncertain numbers in the config")]
Band = Annotated[tuple[BandShare, ...] | None, Field(description="the largest share first")]
Advice = Annotated[str | None, Field(description="what would make the band smaller")]


class Summary(Figures):
    """The figures of `camcomp compensate`; angles and torques where a machine has hinges, `interpolation` of long programs."""

    points: Annotated[int, Field(description="end points of the corrected program")]
    segments_in: Annotated[int, Field(description="motions of the program")]
    lines_in: Annotated[int, Field(description="lines of the program")]
    lines_out: Annotated[int, Field(description="lines of the corrected program")]
    before: ErrorSize
    after: ErrorSize
    actuator_change_max_mm: float
    actuator_force_max_N: float
    actuator_change_max_rad: float | None = None
    actuator_torque_max_Nmm: float | None = None
    iterations_max: int
    method: str
    force: Force
    stated_in_program: Annotated[
        tuple[str, ...] | None, Field(description="stock and tools read from its comments")
    ] = None
    platform_tilt_max_mrad: float
    tilt_after_mrad: Annotated[float | None, Field(description="largest, of programs with orientation")] = None
    joining_lines: int
    cycle_time_s: CycleTime
    control_mode: ControlMode
    control_mode_stated: ControlModeStated
    under_control: Annotated[ErrorSize, Field(description=f"like after, {_CONTROL_ADDS}")]
    taken: Taken = None
    expected: Expected = None
    band: Band = None
    advice: Advice = None
    interpolation: Annotated[Interpolation | None, Field(description="null where no point was interpolated")] = None
    warnings: list[str]


class LineResult(Figures):
    """Residual of one source line in um, and its parts.

    convergence: what the solver itself leaves. rounding: half the last digit written, worst case. vertex: end points
    of moves, where rounding and the sharing of the chord's miss show. chord: what the straight lines between them add.
    """

    line: int
    moves: int
    residual_um: Size
    convergence_um: Size
    rounding_um: Size
    vertex_um: Size
    chord_um: Size
    missed_um: Annotated[Size | None, Field(description="beside what a policy leaves on purpose")] = None

    @property
    def judged_um(self) -> float:
        """Error, µm, to compare with the tolerance."""
        return self.residual_um if self.missed_um is None else self.missed_um


class Verification(Figures):
    """The figures of `camcomp verify`."""

    tolerance_um: float
    residual: ErrorSize
    points: Annotated[int, Field(description="looked at along the feed moves")]
    joining_lines: int
    cycle_time_s: CycleTime
    control_mode: ControlMode
    control_mode_stated: ControlModeStated
    under_control: Annotated[ErrorSize, Field(description=f"like residual, {_CONTROL_ADDS}")]
    warnings: list[str]
    taken: Taken = None
    expected: Expected = None
    band: Band = None
    advice: Advice = None
    lines: tuple[LineResult, ...]
