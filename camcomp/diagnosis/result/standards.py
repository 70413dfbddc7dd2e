"""Values of ISO 230-2 and ISO 9283 as part of a result: what acceptance tests of machines and robots report."""

from __future__ import annotations

from typing import Annotated

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


class PoseValues(Result):
    """A pose that was visited again and again, ISO 9283:1998, um. The commanded pose is that of the nominal arm at the encoders,
    in the frame and with the tool vector that fit best.
    """

    campaign: str
    pose: Annotated[str, Field(description="joints, deg or mm")]
    visits: int
    AP_um: Annotated[float, Field(description="pose accuracy, position")]
    RP_um: Annotated[float, Field(description="pose repeatability, position")]


class StandardValues(Result):
    """What the logs hold of tests by standards, and why they hold no more."""

    positioning: tuple[AxisPositioning, ...] = ()
    poses: tuple[PoseValues, ...] = ()
    absent: tuple[str, ...] = ()
