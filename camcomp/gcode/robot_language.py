"""The parts of one robot language that reader and writer of its programs use."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from camcomp.ground.datatypes import Floats
from camcomp.ground.records import dataclass, field

if TYPE_CHECKING:
    from camcomp.gcode.robot_frames import CoordinateFrame
    from camcomp.gcode.text import Text

BLANKS = " \t\r\n\x1a"  # and the end of file of DOS
Span = tuple[int, int]
Edit = tuple[int, int, str]  # characters begin to end, and what is to stand there


@dataclass(frozen=True, eq=False, kw_only=True)
class MoveSite:
    """Where a move stands in the text, by index of its characters, and in which frames."""

    row: int
    instruction: Span  # from the keyword to behind the last argument
    numbers: Mapping[str, Span]  # of the target's components
    close: int  # where components go that are missing
    blend: Span  # how the end is rounded, with the blank in front; empty: it is not
    base: CoordinateFrame
    tool: CoordinateFrame
    near: Sequence[float] = ()  # components of the target
    said: Sequence[float] | None = None  # components that the control holds behind the move; None: not known
    more: Any = None  # what the language itself wants to know


@dataclass(frozen=True, kw_only=True)
class NewMove:
    """One move to be written. numbers: of every component; fresh: components that the control does not hold already."""

    keeps_kind: bool  # False: an arc or a rapid becomes a straight cut
    numbers: Sequence[str]
    fresh: Sequence[bool]
    changed: Sequence[bool]  # components that the statement says otherwise
    rests: bool  # the end is not rounded, whatever the program says


class RobotLanguage(ABC):
    """Reads the statements of a language and spells its moves."""

    components: tuple[str, ...]
    comment: tuple[str, str]
    comment_width: int = 0  # most characters of a comment; 0: any
    turn_digits: int = 6  # of angles in degrees; quaternions have more

    @abstractmethod
    def read(self, reader: Any) -> None:
        """Pass every move to the reader (a RobotReader), in order. Raises ProgramError with every mistake."""

    @abstractmethod
    def poses(self, values: Floats) -> tuple[Floats, Floats]:
        """Points (n, 3) mm and rotations (n, 3, 3) of components (n, c)."""

    @abstractmethod
    def values(self, points: Floats, rotations: Floats, near: Floats) -> Floats:
        """Components (n, c) of poses, next to components near (n, c)."""

    @abstractmethod
    def in_place(self, text: Text, site: MoveSite, move: NewMove) -> list[Edit]:
        """Changes that make the statement of a move another one."""

    @abstractmethod
    def line(self, text: Text, site: MoveSite, move: NewMove) -> str:
        """A straight cut on a line of its own."""

    @abstractmethod
    def stamp_index(self, text: Text) -> int:
        """Where the stamp goes: the first place at which the language allows a comment on a line of its own."""

    def finish(self, string: str) -> str:
        """The whole text, when all moves are written."""
        return string

    def digits(self, resolution_digits: int) -> list[int]:
        """Digits behind the point of every component."""
        return [resolution_digits] * 3 + [self.turn_digits] * (len(self.components) - 3)


@dataclass(kw_only=True)
class Collected:
    """Moves as they are read, a row each."""

    kind: list[int] = field(default_factory=list)
    values: list[Sequence[float]] = field(default_factory=list)
    middle: list[Sequence[float] | None] = field(default_factory=list)  # of arcs
    sweep_deg: list[float | None] = field(default_factory=list)
    site: list[MoveSite] = field(default_factory=list)
    feed: list[float] = field(default_factory=list)
    joints: list[int] = field(default_factory=list)  # number of the joint pose, -1: a pose in a base
    alone: list[bool] = field(default_factory=list)  # its way from the move before is not known
