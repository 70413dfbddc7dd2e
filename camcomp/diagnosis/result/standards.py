"""Values of acceptance tests of machines and robots in a result: ISO 230-2, ISO 230-4 and ISO 9283."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from camcomp.ground.result import Result


class AxisPositioning(Result):
    """Positioning along a line that one axis drives, ISO 230-2:2014, um. Forward: approached with rising coordinate."""

    axis: str
    line: Annotated[str, Field(description="where the other axes stood, mm")]
    targets: int
    approaches: Annotated[int, Field(description="the fewest from one side of one target")]
    A_um: Annotated[float, Field(description="accuracy, both directions")]
    A_forward_um: float
    A_backward_um: float
    R_um: Annotated[float, Field(description="repeatability, both directions")]
    R_forward_um: float
    R_backward_um: float
    B_um: Annotated[float, Field(description="reversal error, the largest size of one target")]
    B_mean_um: float
    E_um: Annotated[float, Field(description="systematic deviation, both directions")]
    E_forward_um: float
    E_backward_um: float
    M_um: Annotated[float, Field(description="range of the means of both directions")]


class CircularTurn(Result):
    """A circle in one direction in one run, ISO 230-4:2022, um."""

    run: str
    direction: Literal["counter-clockwise", "clockwise"]
    G_um: Annotated[float, Field(description="circular deviation, about the least-squares centre")]
    F_max_um: Annotated[float, Field(description="largest deviation of the radius from the programmed one")]
    F_min_um: Annotated[float, Field(description="least deviation of the radius from the programmed one")]


class CircularTest(Result):
    """A circle under one load in every run that drove it, ISO 230-4:2022, um."""

    circle: Annotated[str, Field(description="radius, plane and centre in the program frame, mm")]
    cutting: Annotated[bool, Field(description="under load, which the standard leaves out")]
    turns: tuple[CircularTurn, ...]
    G_both_um: Annotated[float | None, Field(description="G(b), both directions; null where one was not driven")]


class PoseValues(Result):
    """A repeated pose, ISO 9283:1998, um.

    The commanded pose is that of the nominal arm at the encoders, with the best-fit frame and tool vector.
    """

    campaign: str
    pose: Annotated[str, Field(description="joints, deg or mm")]
    visits: int
    AP_um: Annotated[float, Field(description="pose accuracy, position")]
    RP_um: Annotated[float, Field(description="pose repeatability, position")]


class StandardValues(Result):
    """Values of standard tests in the logs, and reasons for missing ones."""

    positioning: tuple[AxisPositioning, ...] = ()
    circles: tuple[CircularTest, ...] = ()
    poses: tuple[PoseValues, ...] = ()
    absent: tuple[str, ...] = ()
