"""A run of linear moves of a long program: its bytes, its motions, and the control behind it."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from camcomp.gcode.linear_lines import LinearMotions
from camcomp.gcode.program import LETTERS, LINEAR, Sites
from camcomp.gcode.state import ControlState
from camcomp.ground.datatypes import RAPID, Path
from camcomp.ground.records import dataclass


class NotInPieces(Exception):
    """The program has to be read as a whole."""


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
            known=np.ones(n, np.bool_), machine=np.zeros(n, np.bool_), waits=self.waits & (np.arange(n) == 0),
        )  # fmt: skip

    @property
    def sites(self) -> Sites:
        """The words of the motions in the text of the run."""
        linear, n, state = self.linear, self.motions, self.state
        begin, finish = np.full((2, n, len(LETTERS)), -1, np.int32)
        there = linear.begin >= 0
        begin[:, :LINEAR] = np.where(there, linear.begin - self.text_at, -1)
        finish[:, :LINEAR] = np.where(there, linear.finish - self.text_at, -1)
        none = np.zeros(n, np.bool_)
        return Sites(
            row=linear.row, begin=begin, finish=finish, unit=np.full(n, state.unit), feed_unit=np.full(n, state.feed_unit),
            offset=np.tile(state.offset, (n, 1)), relative=none, centre_absolute=np.full(n, state.centre_absolute),
            code=linear.kind, plane=np.full(n, state.plane, np.int8), feed_mode=np.full(n, state.feed_mode, np.int8),
            modal_feed=linear.feed, moved=there[:, :3], code_stated=linear.code_stated, feed_stated=linear.feed_stated,
            modes_changed=none, stops=none, waits_ahead=np.asarray(self.path.waits), waits_in_line=none, fixed=none,
        )  # fmt: skip

    @property
    def text(self) -> bytes:
        """Its lines."""
        return self.data[self.text_at : self.text_end].tobytes()
