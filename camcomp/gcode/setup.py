"""What reading a program needs to know of its machine."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from camcomp.gcode.path_mode import PathMode

Triple = tuple[float, float, float]
ASSUMED = PathMode(stated=False)
ZERO: Triple = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Setup:
    """The control before the program starts; lengths in mm."""

    start_mm: Triple = ZERO  # tool tip in the program frame
    offsets: Mapping[str, Triple] = field(default_factory=dict)  # "G54".."G59.3": origin in the machine frame
    tools: Mapping[int, float] = field(default_factory=dict)  # length offsets
    home_mm: Triple = ZERO  # G28, machine coordinates
    second_home_mm: Triple = ZERO  # G30
    tool: int = 0  # in the spindle
    increment_mm: float | None = None  # what a number without a point counts, on a control that has it so
    table_axes: frozenset[str] = frozenset()  # A, B, C that turn the workpiece and only position it
    path_mode: PathMode = ASSUMED  # until the program says one
    skip_deleted: bool = False  # the block delete switch: lines that start with `/` are not executed
