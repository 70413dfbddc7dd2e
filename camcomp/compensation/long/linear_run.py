"""A run of linear moves of a long program: its bytes, its motions, and the control behind it."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from camcomp.gcode.linear_lines import LinearMotions
from camcomp.gcode.state import ControlState
from camcomp.ground.datatypes import RAPID, Floats, Ints, Path
from camcomp.ground.errors import Location


class NotInPieces(Exception):
    """The program has to be read as a whole."""


class Unsolved(Exception):
    """Points of a run without a solution: motions (k,), targets (k, 3) mm in the machine frame, the solver's status."""

    def __init__(self, move: Ints, target: Floats, status: Ints) -> None:
        super().__init__()
        self.move, self.target, self.status = move, target, status


@dataclass(frozen=True, eq=False, kw_only=True)
class LinearRun:
    """Linear moves: bytes text_at to text_end of `data`."""

    data: np.ndarray
    text_at: int
    text_end: int
    row0: int  # lines of the program before it
    linear: LinearMotions
    state: ControlState  # behind it; position, motion and feed as at its end
    waits: bool  # the control waits for something in front of it

    @property
    def motions(self) -> int:
        """Number of motions."""
        return len(self.linear.row)

    @cached_property
    def path(self) -> Path:
        """The motions as a path."""
        linear, n, state = self.linear, self.motions, self.state
        return Path(
            line=linear.row + self.row0 + 1, kind=linear.kind, start=linear.start, end=linear.end, centre=np.full((n, 3), np.nan),
            axis=np.zeros((n, 3)), angle=np.zeros(n), feed=np.where(linear.kind == RAPID, np.nan, linear.feed),
            speed=np.full(n, state.speed), turn=np.full(n, state.sense), tool=np.full(n, state.tool),
            known=np.ones(n, np.bool_), machine=np.zeros(n, np.bool_),
        )  # fmt: skip

    def parts(self, of: Ints, start: Floats, end: Floats) -> LinearRun:
        """A run of parts (n,) of these motions, from start (n, 3) to end (n, 3)."""
        linear = LinearMotions(*(each[of] for each in self.linear))  # type: ignore[arg-type]
        return replace(self, linear=linear._replace(start=start, end=end))

    def before(self, motion: int) -> ControlState:
        """The control in front of a motion."""
        state = deepcopy(self.state)
        state.position = self.linear.start[motion].tolist()
        state.motion = 10 * int(self.linear.kind[motion])
        feed = float(self.linear.feed[motion])
        state.feed = None if np.isnan(feed) else feed
        return state

    def place(self, name: str, motion: int) -> Location:
        """Where a motion stands in the program of this name: its first axis word."""
        (a, b, _), words = self.linear.line[motion], self.linear.begin[motion, :3]
        text = self.data[a:b].tobytes().decode("latin-1")
        return Location(name, self.row_of(motion) + 1, int(words[words >= 0].min() - a) + 1, text)

    @property
    def text(self) -> bytes:
        """Its lines."""
        return self.data[self.text_at : self.text_end].tobytes()

    def lines_from(self, motion: int) -> tuple[bytes, ControlState, int, int]:
        """The lines from that of a motion on, the control in front of them, the lines before them, and their motions."""
        text = self.data[self.linear.line[motion, 0] : self.text_end].tobytes()
        return text, self.before(motion), self.row_of(motion), self.motions - motion

    def lines_until(self, motion: int) -> tuple[bytes, int]:
        """The lines up to that of a motion, and their motions."""
        return self.data[self.text_at : self.linear.line[motion, 2]].tobytes(), motion + 1

    def row_of(self, motion: int) -> int:
        """Lines of the program before that of a motion."""
        return self.row0 + int(self.linear.row[motion])
