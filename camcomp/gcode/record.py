"""Recorder of the motions of an executed program, as arrays."""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from camcomp.gcode.arcs import PLANES
from camcomp.gcode.path_mode import PathMode
from camcomp.gcode.program import LETTERS, LINEAR, A, G, Sites
from camcomp.gcode.state import ControlState
from camcomp.gcode.text import Text
from camcomp.gcode.words import Word
from camcomp.ground import orientation
from camcomp.ground.datatypes import ARC, LINE, RAPID, Path, frozen

if TYPE_CHECKING:
    from camcomp.gcode.linear_lines import LinearMotions

NUMBERS = 33  # per motion
_NO_CENTRE = [math.nan, math.nan, math.nan]


class RecordedBlock(Protocol):
    """Interface of a block for the recorder."""

    row: int
    words: dict[str, Word]
    groups: dict[int, tuple[int, Word]]
    axes: list[int]


class Recorder:
    """Motions in program order. The interpreter sets flags about the text before each motion."""

    def __init__(self, text: Text) -> None:
        self._starts = text.starts
        self._count = 0
        self._numbers = array("d")  # NUMBERS per motion
        self._spans = array("i")  # 26 per motion
        self._blocks: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []  # earlier motions, as in `_finished`
        self._line_first = 0
        self.code_stated = False
        self.feed_stated = False
        self.modes_changed = False
        self.stops = False
        self.waits_ahead = False
        self.oriented: str | None = None  # form of the orientation words, once there are some
        self._fixed: list[int] = []
        self.modes: list[PathMode] = []  # by motion
        self.cycles: dict[int, tuple[list[tuple[str, list[float]]], str]] = {}  # by first motion

    def __len__(self) -> int:
        return self._count

    def begin_line(self, row: int) -> None:
        """Start a block."""
        self._line_first = self._count
        self.modes_changed = False
        self.stops = False

    def end_line(self) -> None:
        """End a block; the words of a block with several motions belong to none of them."""
        if self._count > self._line_first + 1:
            self._fixed.extend(range(self._line_first, self._count))

    def line_motion(self, block: RecordedBlock, state: ControlState, code: int, end: list[float], feed: float) -> None:
        """Record a rapid (code 0) or a straight cut (code 1)."""
        self._add(
            block=block,
            state=state,
            kind=LINE if code else RAPID,
            code=code,
            end=end,
            centre=_NO_CENTRE,
            angle=0.0,
            feed=feed,
            machine=False,
            moved=block.axes,
        )

    def machine_motion(
        self,
        block: RecordedBlock,
        state: ControlState,
        code: int,
        end: list[float],
        feed: float = math.nan,
        moved: Sequence[int] | None = None,
    ) -> None:
        """Record a move in machine coordinates; code -1 to the intermediate point, -2 to the reference point of G28."""
        axes = block.axes if moved is None else moved
        kind = LINE if code == 1 else RAPID
        self._add(
            block=block,
            state=state,
            kind=kind,
            code=code,
            end=end,
            centre=_NO_CENTRE,
            angle=0.0,
            feed=feed,
            machine=True,
            moved=axes,
        )

    def arc_motion(
        self,
        block: RecordedBlock,
        state: ControlState,
        code: int,
        end: list[float],
        centre: list[float],
        *,
        angle: float,
        feed: float,
    ) -> None:
        """Record an arc or helix."""
        self._add(
            block=block,
            state=state,
            kind=ARC,
            code=code,
            end=end,
            centre=centre,
            angle=angle,
            feed=feed,
            machine=False,
            moved=block.axes,
        )

    def _add(
        self,
        block: RecordedBlock,
        state: ControlState,
        kind: int,
        code: int,
        end: list[float],
        *,
        centre: Sequence[float],
        angle: float,
        feed: float,
        machine: bool,
        moved: Sequence[int],
    ) -> None:
        flags = (
            machine
            | all(state.commanded) << 1
            | state.relative << 2
            | state.centre_absolute << 3
            | self.code_stated << 4
            | self.feed_stated << 5
            | self.modes_changed << 6
            | self.stops << 7
        )
        for axis in moved:
            flags |= 1 << 8 + axis
        waits = self.waits_ahead | state.waits << 1
        self._numbers.extend((block.row, kind, code, *state.position, *end, *centre, angle, feed))
        modal = math.nan if state.feed is None else state.feed
        self._numbers.extend((state.speed, state.tool, state.unit, *state.offset))
        self._numbers.extend((state.plane, state.feed_mode, flags, modal, state.sense, waits, state.feed_unit))
        self._numbers.extend((*state.turned, *state.turns_to))
        state.turned = state.turns_to
        self.waits_ahead = state.waits = False
        base = int(self._starts[block.row])
        g = block.groups.get(1)
        for k, letter in enumerate((*LETTERS[:A], *orientation.LETTERS[state.orientation_form])):
            word = block.words.get(letter) if k != G else g and g[1]
            if letter in state.table or (k >= A and not state.setup.orients):
                word = None
            self._spans.extend((base + word.begin, base + word.end) if word else (-1, -1))
        self.modes.append(state.path_mode)
        self._count += 1
        if code >= 0:
            self.code_stated = self.feed_stated = False
        state.position = end

    def linear_motions(self, row: int, found: LinearMotions, state: ControlState) -> None:
        """Motions of linear moves, the first of which is line `row`; state: that in front of them."""
        n = len(found.row)
        numbers = np.empty((NUMBERS, n))
        numbers[12] = numbers[25] = 0.0
        numbers[0], numbers[1], numbers[2] = row + found.row, found.kind, found.kind != RAPID
        numbers[3:6], numbers[6:9], numbers[9:12] = found.start.T, found.end.T, math.nan
        numbers[13] = np.where(found.kind == RAPID, math.nan, found.feed)
        numbers[14:20] = np.array((state.speed, state.tool, state.unit, *state.offset))[:, None]
        flags = 2 | state.centre_absolute << 3 | found.code_stated.astype(int) << 4 | found.feed_stated.astype(int) << 5
        for axis in range(3):
            flags |= (found.begin[:, axis] >= 0).astype(int) << 8 + axis
        numbers[20], numbers[21], numbers[22], numbers[23] = state.plane, state.feed_mode, flags, found.feed
        numbers[24], numbers[25, 0], numbers[26] = state.sense, state.waits, state.feed_unit
        numbers[27:33] = np.array((*state.turns_to, *state.turns_to))[:, None]
        numbers[27:30, 0] = state.turned
        begin, finish = np.full((2, n, len(LETTERS)), -1, np.int32)
        begin[:, :LINEAR], finish[:, :LINEAR] = found.begin, found.finish
        self._end_block()
        self._blocks.append((numbers, begin, finish))
        self.modes += [state.path_mode] * n
        self._count += n
        state.turned, state.waits = state.turns_to, False

    def cycle(self, actions: list[tuple[str, list[float]]], irreplaceable: str) -> None:
        """Record a canned cycle: its actions in order, and the reason why moves cannot replace it (empty: they can)."""
        if self._count == self._line_first + 1:
            self._fixed.append(self._line_first)
        self.cycles[self._line_first] = (list(actions), irreplaceable)

    def _end_block(self) -> None:
        """Put the motions that were recorded one by one behind the blocks."""
        if len(self._numbers):
            spans = np.frombuffer(self._spans, np.int32).reshape(-1, len(LETTERS), 2)
            numbers = np.frombuffer(self._numbers, float).reshape(-1, NUMBERS).T
            self._blocks.append((numbers, spans[:, :, 0], spans[:, :, 1]))
            self._numbers, self._spans = array("d"), array("i")

    def _finished(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Numbers (NUMBERS, n) of the motions, first and last index (n, 13) of their words."""
        self._end_block()
        if len(self._blocks) == 1:
            return self._blocks[0]
        none = np.zeros((0, len(LETTERS)), np.int32)
        numbers, begin, finish = zip((np.zeros((NUMBERS, 0)), none, none), *self._blocks, strict=True)
        return np.concatenate(numbers, axis=1), np.concatenate(begin), np.concatenate(finish)

    def finish(self) -> tuple[Path, Sites]:
        """All motions as arrays."""
        n = self._count
        a, begin, finish = self._finished()
        turning = None
        if self.oriented is not None:
            turning = orientation.Orientation(self.oriented, frozen(a[27:30].T), frozen(a[30:33].T))
        kind = a[1].astype(np.int8)
        flags = a[22].astype(np.int64)
        plane = a[20].astype(np.int8)
        axis = np.zeros((n, 3))
        for number, (_, _, w) in PLANES.items():
            axis[(kind == ARC) & (plane == number), w] = 1.0
        path = Path(
            line=a[0].astype(np.int64) + 1,
            kind=kind,
            start=a[3:6].T,
            end=a[6:9].T,
            centre=a[9:12].T,
            axis=axis,
            angle=a[12],
            feed=a[13],
            speed=a[14],
            turn=a[24],
            tool=a[15].astype(np.int64),
            known=(flags & 2) > 0,
            machine=(flags & 1) > 0,
            waits=a[25] > 0,
            orientation=turning,
        )
        fixed = np.zeros(n, bool)
        fixed[self._fixed] = True
        sites = Sites(
            row=frozen(a[0], np.int64),
            begin=frozen(begin, np.int32),
            finish=frozen(finish, np.int32),
            unit=frozen(a[16]),
            feed_unit=frozen(a[26]),
            offset=frozen(a[17:20].T),
            relative=frozen((flags & 4) > 0, np.bool_),
            centre_absolute=frozen((flags & 8) > 0, np.bool_),
            code=frozen(a[2], np.int8),
            plane=frozen(plane, np.int8),
            feed_mode=frozen(a[21], np.int8),
            modal_feed=frozen(a[23]),
            moved=frozen(np.stack([(flags & 1 << bit) > 0 for bit in (8, 9, 10)], axis=1), np.bool_),
            code_stated=frozen((flags & 16) > 0, np.bool_),
            feed_stated=frozen((flags & 32) > 0, np.bool_),
            modes_changed=frozen((flags & 64) > 0, np.bool_),
            stops=frozen((flags & 128) > 0, np.bool_),
            waits_ahead=frozen(a[25] % 2.0 == 1.0, np.bool_),
            waits_in_line=frozen(a[25] >= 2.0, np.bool_),
            fixed=frozen(fixed, np.bool_),
        )
        return path, sites
