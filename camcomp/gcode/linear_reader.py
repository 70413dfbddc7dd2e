"""Runs of linear moves for the interpreter: read compiled, recorded as the interpreter would have recorded them."""

from __future__ import annotations

import numpy as np

from camcomp.gcode.linear_lines import G, LinearMotions, scan
from camcomp.gcode.record import Recorder
from camcomp.gcode.state import ControlState
from camcomp.gcode.text import Text

MIN_RUN = 4  # rows; for shorter runs the interpreter is as fast
MAX_RUN = 1 << 15  # motions
MAX_PAUSE = 64  # rows left to the interpreter behind runs that were too short


def is_linear(state: ControlState) -> bool:
    """Whether linear moves mean G0 and G1 moves to absolute positions with a feed per minute in this state."""
    return (
        not state.relative
        and state.feed_mode == 94
        and state.feed_unit == state.unit
        and all(state.commanded)
        and state.motion in (None, 0, 10)
        and not state.length_off
    )


def motion_number(state: ControlState) -> int:
    """Motion code in force as `scan` takes it: 0, 1, or -1 for none."""
    return -1 if state.motion is None else state.motion // 10


def follow(state: ControlState, code: int, feed: float, position: np.ndarray) -> None:
    """Set the state behind linear moves: code as `scan` returns it, feed mm/min (0: none), position (3,) mm."""
    if code >= 0:
        state.motion = state.outside_cycles = 10 * int(code)
    state.feed = feed if feed > 0.0 else None
    state.position = position.tolist()


class LinearReader:
    """Reads ahead in one text; between its runs the interpreter executes single lines."""

    def __init__(self, text: Text, state: ControlState, record: Recorder, rows: int, increments: bool) -> None:
        """rows: those of the text that count. increments: numbers without a point are left to the interpreter."""
        self._data = np.frombuffer(text.string.encode("latin-1", "replace"), np.uint8)
        self._starts, self._stop = text.starts, int(text.nexts[rows - 1])
        self._state, self._record, self._increments = state, record, increments
        self._room = LinearMotions.room(min(rows, MAX_RUN))
        self._last = self._stop == len(self._data)
        self._pause, self._resume = 0, 0

    def read(self, row: int) -> tuple[int, bool]:
        """Read and record the linear moves from `row` on.

        Returns the row behind them (`row` where there are too few) and whether one of them has a G word.
        """
        state, record = self._state, self._record
        if row < self._resume or not is_linear(state):
            return row, False
        position = np.array(state.position)
        n, rows, _, _, code, feed, coded, fed = scan(
            self._data, int(self._starts[row]), self._stop, self._last, motion_number(state), state.feed or 0.0,
            record.code_stated, record.feed_stated, position, state.unit, np.array(state.offset), self._increments,
            self._room, len(self._room.row),
        )  # fmt: skip
        if rows < MIN_RUN or not n:
            self._pause = min(2 * self._pause + 1, MAX_PAUSE)
            self._resume = row + rows + self._pause
            return row, False
        self._pause = 0
        found = self._room.take(0, n)
        record.linear_motions(row, found, state)
        follow(state, code, feed, position)
        record.code_stated, record.feed_stated = bool(coded), bool(fed)
        return row + rows, bool((found.begin[:, G] >= 0).any())
