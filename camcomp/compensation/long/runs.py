"""A long program in pieces: runs of linear moves, read compiled, and what stands between them, read by the interpreter.

Every piece knows the state of the control at its begin, so that it can be corrected and written by itself. Programs that
jump, loop or call cannot be cut into pieces; they are recognised and left to the reader of whole programs.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from typing import BinaryIO

import numpy as np

from camcomp.gcode.detect import dialect_of
from camcomp.gcode.interpret import Interpreter, controller
from camcomp.gcode.linear_lines import LONGEST_END, MORE, LinearMotions, scan
from camcomp.gcode.linear_reader import follow, is_linear, motion_number
from camcomp.gcode.program import Program
from camcomp.gcode.setup import Setup
from camcomp.gcode.state import ControlState
from camcomp.gcode.text import END_OF_LINE, Text
from camcomp.gcode.uncorrected import behind_end_warning, has_motion
from camcomp.gcode.words import points_in_feeds
from camcomp.ground.errors import Location, ProgramError
from camcomp.ground.records import dataclass, field, replace
from camcomp.model.config.spec import Config
from camcomp.model.control import waiting_s

CHUNK_BYTES = 1 << 21  # bytes read at once
RUN = 1 << 15  # motions of a linear run at most
RUN_BYTES = (
    1 << 20
)  # of a run, about: so many are read before it is scanned, because one that is cut off is scanned twice
PROBE_MOTIONS = 48  # linear motions in a row that make a run of their own
_PROGRAM = re.compile(rb"(?:^|[\r\n])[ \t]*[O:][ \t]*\d", re.IGNORECASE)
_END = re.compile(END_OF_LINE.encode())


@dataclass(frozen=True, eq=False)
class Piece(Text):
    """Text of some lines of a program; places are those in the whole program."""

    row0: int = 0

    def place(self, index: int, column: int = 0) -> Location:
        """Place of a character in the whole program."""
        return replace(super().place(index, column), line=self.row0 + index + 1)


class NotInPieces(Exception):
    """The program has to be read as a whole."""


@dataclass(eq=False, kw_only=True)
class ProgramRun:
    """Lines of a program, collected one after the other, and the motions in them."""

    row0: int  # lines of the program before it
    state: ControlState  # in front of it
    stated: list[bool]  # motion code and feed were stated between the motion in front of it and its first line
    lines: list[bytes] = field(default_factory=list)
    motions: int = 0
    linear: LinearMotions | None = None  # the motions, if all are linear moves and read; None: for the interpreter

    @property
    def text(self) -> bytes:
        """Its lines."""
        return b"".join(self.lines)

    def add(self, lines: list[bytes], motions: int) -> None:
        """Add lines and the number of their motions."""
        self.lines += lines
        self.motions += motions


@dataclass(eq=False, kw_only=True)
class Runs:
    """Cuts a program into runs. `warnings` and `behind_end` (the program's end) grow while it is read."""

    source: BinaryIO
    name: str
    setup: Setup
    dialect: str | None
    warnings: list[str] = field(default_factory=list)
    behind_end: list[str] = field(default_factory=list)
    motions: int = 0

    def __post_init__(self) -> None:
        self.digest = hashlib.sha256()  # of the bytes read so far
        head = self._read()
        if head[:2] in (b"\xff\xfe", b"\xfe\xff") or head[:3] == b"\xef\xbb\xbf":
            raise NotInPieces
        self._data = np.frombuffer(head, np.uint8)
        self._at = 0
        self._row = 0
        self._last = len(head) < CHUNK_BYTES
        begin = Text.read(head[:200_000], self.name)
        self.language = dialect_of(begin, self.dialect)
        self.feed_point = points_in_feeds(begin.line(row) for row in range(len(begin)))
        self._state = ControlState(self.setup, self.language)
        self._flags = [False, False]  # code stated, feed stated
        self._tape = False  # the program began with a %
        self._seen = False  # a line with something in it was read
        self._told: set[str] = set()

    def __iter__(self) -> Iterator[ProgramRun | bytes]:
        """Runs in order; bytes behind the program's end, as they are."""
        held: ProgramRun | None = None
        ended = False
        while not ended:
            row, before = self._row, self._state
            found = self._linear(RUN if held is None else PROBE_MOTIONS)
            if found is not None:
                if held is not None and found.motions < PROBE_MOTIONS:
                    held.add(found.lines, found.motions)
                    continue
                if held is not None:
                    yield held
                    held = None
                yield found
                continue
            line = self._next_line()
            if line is None:
                break
            held = held or ProgramRun(row0=row, state=before.copy(), stated=list(self._flags))
            motions, ended = self._interpret(line)
            held.add([line], motions)
        if held is not None:
            yield held
        if not self.motions:
            raise ProgramError("CC100", "the program moves nothing", at=Location(self.name, 1, 1))
        yield from self._rest()

    def waiting_s(self, config: Config) -> float:
        """Time, s, of the dwells and tool changes read so far."""
        return waiting_s(config, self._state.dwelt_s, self._state.tool_changes)

    # --- bytes ---------------------------------------------------------------------------------------------------

    def _more(self) -> bool:
        """Read the next chunk and append it to the unread bytes."""
        if self._last:
            return False
        fresh = self._read()
        self._last = len(fresh) < CHUNK_BYTES
        self._data = np.frombuffer(self._data[self._at :].tobytes() + fresh, np.uint8)
        self._at = 0
        return True

    def _read(self) -> bytes:
        data = self.source.read(CHUNK_BYTES)
        self.digest.update(data)
        return data

    def _next_line(self) -> bytes | None:
        while True:
            rest = self._data[self._at : self._at + (1 << 16)].tobytes()
            if not rest and self._last:
                return None
            found = _END.search(rest)
            if found and (found.end() + LONGEST_END <= len(rest) or self._last):
                end = found.end()
                break
            if not self._more():
                end = len(rest)
                if len(rest) == 1 << 16:
                    raise NotInPieces  # a line of 64 KB
                break
        self._at += end
        return rest[:end]

    def _rest(self) -> Iterator[bytes]:
        moving = first = 0
        while True:
            data = self._data[self._at :].tobytes()
            if self.language.flow == "macro" and _PROGRAM.search(data):
                raise NotInPieces  # another program, which may be called or stand there by mistake
            lines = [row for row, line in enumerate(_END.split(data)) if has_motion(line.decode("latin-1"))]
            if lines:
                moving, first = moving + len(lines), first or self._row + lines[0] + 1
            self._row += len(_END.findall(data))
            yield data
            self._at = len(self._data)
            if not self._more():
                break
        if moving:
            self.behind_end.append(behind_end_warning(self.name, moving, first))

    # --- lines ---------------------------------------------------------------------------------------------------

    def _linear(self, limit: int) -> ProgramRun | None:
        """The linear moves from here on; None if they contain no motion."""
        state = self._state
        if not is_linear(state):
            return None
        if limit == RUN and len(self._data) - self._at < RUN_BYTES:
            self._more()
        room, position, data = LinearMotions.room(limit), np.array(state.position), self._data[self._at :]
        n, rows, end, why, code, feed, coded, fed = scan(
            data, 0, len(data), self._last, motion_number(state), state.feed or 0.0, *self._flags,
            position, state.unit, np.array(state.offset), self.language.increments, room, limit,
        )  # fmt: skip
        if why == MORE and n < limit and self._more():
            return self._linear(limit)
        if n == 0:
            return None
        run = ProgramRun(
            row0=self._row, state=state.copy(), stated=self._flags, lines=[data[:end].tobytes()], motions=n,
            linear=room.take(0, n),
        )  # fmt: skip
        self._flags = [bool(coded), bool(fed)]
        follow(state, code, feed, position)
        state.waits = False
        self._at += end
        self._row += rows
        self.motions += n
        return run

    def _interpret(self, line: bytes) -> tuple[int, bool]:
        """Executes a line: its number of motions, and whether the program ends there."""
        stripped = line.strip(b" \t\0\r\n\x1a\x0b\x0c")
        row, self._row = self._row, self._row + 1
        if stripped.startswith(b"%"):
            if self._tape:
                return 0, True
            self._tape = not self._seen
        self._seen = self._seen or bool(stripped)
        text = Piece(self.name, line.decode("latin-1"), "latin-1", b"", row)
        if not len(text):
            return 0, False
        reader = self.reader(text, self._state)
        reader.record.code_stated, reader.record.feed_stated = self._flags
        after = controller(reader).step(0)
        self.check(reader)
        if after not in (None, 1) or (reader.rebases and self.motions):
            raise NotInPieces  # a jump; or it sets what depends on where the corrected program has led
        motions = len(reader.record)
        self._flags = [reader.record.code_stated, reader.record.feed_stated]
        self.motions += motions
        return motions, after is None

    def reader(self, text: Text, state: ControlState) -> Interpreter:
        """An interpreter for some lines, in a state of the control."""
        reader = Interpreter(text, self.setup, self.language)
        reader.state = state
        reader._warned = self._told
        reader.warnings = self.warnings
        return reader

    def check(self, reader: Interpreter) -> None:
        """Raises NotInPieces when a line did what only the reader of whole programs can follow."""
        if not reader.straight or reader.record.cycles:
            raise NotInPieces

    def program(self, run: ProgramRun) -> Program:
        """A run as a program of its own, from the state of the control in front of it on."""
        text = Piece(self.name, run.text.decode("latin-1"), "latin-1", b"", run.row0)
        reader = self.reader(text, run.state.copy())
        reader.warnings = []
        reader.record.code_stated, reader.record.feed_stated = run.stated
        if run.linear is None:
            controller(reader).run()
            self.check(reader)
        else:
            reader.record.linear_motions(0, run.linear, reader.state)
        path, sites = reader.record.finish()
        return Program(
            data=run.text, name=self.name, dialect=self.language.name, path=replace(path, line=path.line + run.row0),
            warnings=(), text=text, sites=sites, rebases=tuple(reader.rebases), setup=self.setup, language=self.language,
            feed_point=self.feed_point, modes=tuple(reader.record.modes), straight=True,
        )  # fmt: skip
