"""Result of reading a program: its path, and the positions of its numbers in the text."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from camcomp.gcode.dialect import Dialect
from camcomp.gcode.path_mode import PathMode
from camcomp.gcode.robot_frames import RobotFrames
from camcomp.gcode.robot_language import MoveSite
from camcomp.gcode.setup import Setup, Triple
from camcomp.gcode.text import Text
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints, Path
from camcomp.ground.records import dataclass, fields
from camcomp.ground.vectors import distinct

# Columns of Sites.begin and Sites.finish.
X, Y, Z, F, G, I, J, K, R, P, A, B, C = range(13)
LETTERS = "XYZFGIJKRPABC"  # A, B, C: words of the orientation of any notation
LINEAR = 5  # columns of the words of linear moves, as in LinearMotions.begin and finish


@dataclass(frozen=True, eq=False, kw_only=True)
class Sites:
    """Position in the text and modal state of each of n motions, for rewriting.

    Internal to camcomp/gcode: the reader fills it, the writer uses it.
    """

    row: Ints  # (n,) line index, from 0
    begin: NDArray[np.int32]  # (n, 13) index in the text of each word's letter, -1 for a missing word
    finish: NDArray[np.int32]  # (n, 13) index behind each word
    unit: Floats  # (n,) mm per programmed unit
    feed_unit: Floats  # (n,) mm per programmed unit of feeds
    offset: Floats  # (n, 3) mm from a local value to the program frame
    relative: Bools  # (n,) G91
    centre_absolute: Bools  # (n,) G90.1
    code: NDArray[np.int8]  # (n,) 0..3, the motion code in force; -1 and -2 for statements without one (G28)
    plane: NDArray[np.int8]  # (n,) 17, 18 or 19
    feed_mode: NDArray[np.int8]  # (n,) 93, 94 or 95
    modal_feed: Floats  # (n,) feed in force: mm/min in G94, mm/rev in G95, 1/min in G93; NaN: none
    moved: Bools  # (n, 3) axes that the statement commands
    code_stated: Bools  # (n,) the motion code was stated since the previous motion
    feed_stated: Bools  # (n,) an F word was read since the previous motion
    modes_changed: Bools  # (n,) the line changes a mode on which the meaning of its words depends
    stops: Bools  # (n,) the line stops the program after its motion (M0, M2, ...)
    waits_ahead: Bools  # (n,) the controller waits for something in front of the line
    waits_in_line: Bools  # (n,) it waits for words of the line, such as G4, before the motion
    fixed: Bools  # (n,) the line has several motions or no G0..G3: not to be rewritten in place

    def stretches(self, rows: Sequence[slice]) -> "Sites":
        """Those of some stretches of the motions, one behind the other."""
        columns = {each.name: getattr(self, each.name) for each in fields(self)}
        return Sites(**{name: np.concatenate([column[each] for each in rows]) for name, column in columns.items()})


@dataclass(frozen=True)
class Rebase:
    """A statement whose effect depends on the position of the machine (G92 X0): line, words, values."""

    motion: int  # number of motions before it
    row: int
    axes: tuple[tuple[int, int, int], ...]  # axis, index of the letter in the text, index behind the word
    value: Triple  # programmed values, in units
    unit: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Program:
    """A program that has been read: its bytes, the path of the tool tip, and the data for rewriting it."""

    data: bytes
    name: str
    dialect: str
    path: Path
    warnings: tuple[str, ...]
    text: Text
    sites: Sites
    rebases: tuple[Rebase, ...]
    setup: Setup
    language: Dialect
    feed_point: bool  # feeds have a decimal point; some controllers read whole numbers in smaller units
    modes: tuple[PathMode, ...]  # (n,) path mode of each motion
    straight: bool  # no loops, subprograms, parameters, cycles: a line is at most one motion
    dwelt_s: float = 0.0  # G4 in all
    tool_changes: int = 0  # M6 in all
    robot_moves: tuple[MoveSite, ...] = ()  # (n,) where the moves of a robot program stand in the text
    robot_frames: RobotFrames | None = None

    @property
    def per_turn(self) -> Bools:
        """Mask (n,) of motions with feed per revolution (G95)."""
        return np.asarray((self.sites.feed_mode == 95) & (self.path.kind != RAPID))

    def step_mm(self, resolution_mm: float) -> float:
        """Coarsest step of its lengths (mm) for a controller of this resolution."""
        return max(self.language.step_mm(resolution_mm, each) for each in {1.0, *distinct(self.sites.unit)})
