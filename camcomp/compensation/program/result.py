"""The figures of a compensation and of a verification as types: what `--summary` and `verify --json` write."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import ConfigDict, Field

from camcomp.ground.result import Result, Size


class ErrorSize(Result):
    """Distance of the loaded tip from the programmed one."""

    rms_um: Size
    max_um: Size


class Interpolation(Result):
    """Of a long program: how many points were solved exactly, and how far a sample is from its exact solution."""

    bound_um: float
    checked: int
    worst_um: Size
    worst_drive_force: Size
    tiles: int
    exact_solutions: int


class Summary(Result):
    """The figures of `camcomp compensate`; angles and torques where a machine has hinges, `interpolation` of long programs."""

    model_config = ConfigDict(json_schema_serialization_defaults_required=False)

    points: Annotated[int, Field(description="end points of the corrected program")]
    segments_in: Annotated[int, Field(description="motions of the program")]
    lines_out: int
    before: ErrorSize
    after: ErrorSize
    actuator_change_max_mm: float
    actuator_force_max_N: float
    actuator_change_max_rad: float | None = None
    actuator_torque_max_Nmm: float | None = None
    iterations_max: int
    method: str
    platform_tilt_max_mrad: float
    joining_lines: int
    interpolation: Annotated[Interpolation | None, Field(description="null where no point was interpolated")] = None
    warnings: list[str]

    def as_json(self) -> dict[str, Any]:
        """As a mapping of what JSON knows, without the keys that this machine or program has no use for."""
        return self.model_dump(mode="json", exclude_unset=True)


class LineResult(Result):
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


class Verification(Result):
    """The figures of `camcomp verify`."""

    tolerance_um: float
    residual: ErrorSize
    points: Annotated[int, Field(description="looked at along the feed moves")]
    joining_lines: int
    lines: tuple[LineResult, ...]
