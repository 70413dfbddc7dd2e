"""YAML specs of the cutting tool and of the stock."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from camcomp.model.config.base import NotNegative, Positive, Spec, Vector


class Cutter(Spec):
    """The cutting part of a tool."""

    diameter_mm: Positive | None = Field(None, description="diameter of the cutting part")
    teeth: Annotated[int, Field(ge=1)] | None = Field(None, description="number of cutting edges")
    type: Literal["flat", "ball", "bull", "drill"] | None = Field(
        None, description="form of the tip, for a known stock; default: flat"
    )
    corner_radius_mm: Positive | None = Field(None, description="of a bull nose")
    point_deg: Annotated[float, Field(gt=0, lt=180)] | None = Field(
        None, description="angle of the point of a drill; default: 118"
    )
    flute_length_mm: Positive | None = Field(None, description="of the cutting edges; deeper cuts are warned of")

    @model_validator(mode="after")
    def _corner(self) -> Cutter:
        if (self.type == "bull") != (self.corner_radius_mm is not None):
            raise PydanticCustomError("CC215", "corner_radius_mm goes with type: bull, and bull with corner_radius_mm")
        if self.corner_radius_mm and self.diameter_mm and self.corner_radius_mm > 0.5 * self.diameter_mm:
            raise PydanticCustomError("CC205", "corner_radius_mm is larger than the radius of the tool")
        if self.point_deg is not None and self.type != "drill":
            raise PydanticCustomError("CC215", "point_deg goes with type: drill")
        return self


class NumberedCutter(Cutter):
    """The cutting part of the tool with this T number."""

    file: str | None = Field(
        None,
        examples=["6mm_Ball_End.fctb"],
        description="FreeCAD tool bit (.fctb) that states the keys which are left out; from the folder of the config file",
    )


class ToolTableFile(Spec):
    """Tools from a table of another program; tools that stand under their numbers as well count as written there."""

    file: str | None = Field(
        None,
        examples=["tool.tbl"],
        description="tool table: LinuxCNC (.tbl), FreeCAD (.fctl) or CSV (.csv), from the folder of the config file; "
        "`tools: FILE` means the same",
    )
    unit: Literal["mm", "inch"] = Field("mm", description="of a tool.tbl, which states none: that of the machine")


Resolution = Annotated[float, Field(ge=0.01, le=5.0)] | None
_RESOLUTION = Field(None, description="distance of the nodes of the height field; default: by the smallest tool")


class BoxStock(Spec):
    """A block with its edges along the program's axes."""

    type: Literal["box"]
    min_mm: Vector = Field(description="lowest corner in the program frame")
    max_mm: Vector = Field(description="highest corner in the program frame")
    resolution_mm: Resolution = _RESOLUTION

    @model_validator(mode="after")
    def _room(self) -> BoxStock:
        if not all(a < b for a, b in zip(self.min_mm, self.max_mm, strict=True)):
            raise PydanticCustomError("CC205", "min_mm has to be below max_mm on every axis")
        return self


class CylinderStock(Spec):
    """A round bar that stands along the tool."""

    type: Literal["cylinder"]
    diameter_mm: Positive = Field(description="diameter of the bar")
    centre_mm: Annotated[list[float], Field(min_length=2, max_length=2)] = Field(
        default_factory=lambda: [0.0, 0.0], description="its axis in X and Y of the program frame"
    )
    bottom_mm: float = Field(description="Z of its lower face")
    top_mm: float = Field(description="Z of its upper face")
    resolution_mm: Resolution = _RESOLUTION

    @model_validator(mode="after")
    def _room(self) -> CylinderStock:
        if not self.bottom_mm < self.top_mm:
            raise PydanticCustomError("CC205", "bottom_mm has to be below top_mm")
        return self


class StlStock(Spec):
    """A body from an STL file, mm in the program frame; what overhangs counts as filled up from below."""

    type: Literal["stl"]
    file: str = Field(description="STL file; a relative path counts from the folder of the config file")
    resolution_mm: Resolution = _RESOLUTION


class ProgramStock(Spec):
    """A block about everything that the program feeds through."""

    type: Literal["program"]
    margin_mm: NotNegative = Field(0.0, description="beyond the edge of the tool and below its lowest point")
    top_mm: float | None = Field(
        None,
        description="default: workpiece.stock_top_mm, else 0 where the program feeds below it, else margin_mm above "
        "the highest move across the tool",
    )
    resolution_mm: Resolution = _RESOLUTION


class CommentsStock(Spec):
    """The stock that comments of the program state."""

    type: Literal["comments"]
    resolution_mm: Resolution = _RESOLUTION


Stock = Annotated[BoxStock | CylinderStock | StlStock | ProgramStock | CommentsStock, Field(discriminator="type")]
