"""Settings of the machine for reading a program."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from camcomp.gcode.path_mode import PathMode
from camcomp.gcode.robot_frames import RobotFrames
from camcomp.ground.records import dataclass, field

Triple = tuple[float, float, float]
ASSUMED = PathMode(stated=False)
ZERO: Triple = (0.0, 0.0, 0.0)
TURNS = 1e-12  # entries of a rotation below it are round-off


@dataclass(frozen=True, kw_only=True)
class Setup:
    """State of the controller at the start of the program; lengths in mm."""

    start_mm: Triple = ZERO  # tool tip in the program frame
    offsets: Mapping[str, Triple] = field(default_factory=dict)  # "G54".."G59.3": origin in the machine frame
    tools: Mapping[int, float] = field(default_factory=dict)  # length offsets
    home_mm: Triple = ZERO  # G28, machine coordinates
    second_home_mm: Triple = ZERO  # G30
    tool: int = 0  # in the spindle
    unit_mm: float = 1.0  # of lengths and feeds until the program states one
    increment_mm: float | None = None  # unit of a number without a point, on controllers that count increments
    orients: bool = False  # the machine has six actuators, so that words of orientation move its tool
    table_axes: frozenset[str] = frozenset()  # A, B, C that turn the workpiece and only position it
    path_mode: PathMode = ASSUMED  # until the program states one
    skip_deleted: bool = False  # the block delete switch: lines that start with `/` are not executed
    rotation: tuple[Triple, Triple, Triple] | None = None  # program axes in machine axes; None: parallel
    frames: Callable[[], RobotFrames] | None = None  # of the arm, for programs in its own language

    def in_machine_axes(self, vector: Sequence[float]) -> list[float]:
        """A vector (3,) of program axes in machine axes."""
        if self.rotation is None:
            return list(vector)
        return [sum(row[i] * vector[i] for i in range(3)) for row in self.rotation]

    def in_program_axes(self, vector: Sequence[float]) -> list[float]:
        """A vector (3,) of machine axes in program axes."""
        if self.rotation is None:
            return list(vector)
        return [sum(self.rotation[i][axis] * vector[i] for i in range(3)) for axis in range(3)]

    def known_in_machine_axes(self, known: Sequence[bool]) -> list[bool]:
        """Machine axes whose position follows from the program axes that are known."""
        if self.rotation is None:
            return list(known)
        return [all(known[i] or abs(row[i]) < TURNS for i in range(3)) for row in self.rotation]

    def known_in_program_axes(self, known: Sequence[bool]) -> list[bool]:
        """Program axes whose position follows from the machine axes that are known."""
        if self.rotation is None:
            return list(known)
        return [all(known[i] or abs(self.rotation[i][axis]) < TURNS for i in range(3)) for axis in range(3)]
