"""Order of execution of lines: top to bottom, or by O-words and macro statements."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NoReturn

from camcomp.gcode.block import BlockReader
from camcomp.gcode.expressions import Expression, ExpressionError, parameters_of
from camcomp.gcode.memory import Parameters
from camcomp.gcode.siemens import read_siemens_line
from camcomp.gcode.spelling import FANUC
from camcomp.gcode.text import Text
from camcomp.gcode.trace import Trace
from camcomp.gcode.words import BLANK, Line, Word, code_of, read_line
from camcomp.ground.errors import ProgramError

if TYPE_CHECKING:
    from camcomp.gcode.linear_reader import LinearReader

_MOST_BLOCKS = 150_000  # executed by a program that has loops
_MOST_IDLE = 100_000  # consecutive blocks without a motion
MIN_ROWS = 256  # of a program that is searched for runs of linear moves
_INCREMENTAL_LETTERS = "XYZIJKRQ"


class Flow:
    """Executes lines from top to bottom; the base of dialects with jumps."""

    def __init__(self, reader: BlockReader, trace: Trace | None = None) -> None:
        self.reader = reader
        self.trace = trace
        self.text: Text = reader.text
        self.spelling = reader.dialect.spelling
        self.memory = Parameters(reader.state, macro=self.spelling is FANUC)
        if self.spelling is not None:
            self.memory.spelling = self.spelling
        self._lines: dict[int, Line] = {}
        self._blocks = 0
        self._idle = 0
        self._motions = 0
        self.rows = self.end_row = self._end_of_tape()  # end_row: behind the last line that is run

    # --- the program as a whole --------------------------------------------------------------------------------

    def run(self) -> None:
        """Execute from the first line to the program's end."""
        ahead = self._reader_ahead()
        row = 0
        while row < self.rows:
            if ahead is not None:
                behind, stated = ahead.read(row)
                if behind > row:
                    self._passed(behind - row, stated)
                    row = behind
                    continue
            after = self.step(row)
            if after is None:
                self.end_row = row + 1
                return
            row = after

    def _reader_ahead(self) -> LinearReader | None:
        """The reader of runs of linear moves; None where the program is too short for it or every line is asked for."""
        if self.trace is not None or self.rows < MIN_ROWS:
            return None
        from camcomp.gcode.linear_reader import LinearReader  # loads the compiler, which short programs do not wait for

        reader = self.reader
        return LinearReader(self.text, reader.state, reader.record, self.rows, reader.dialect.increments)

    def _passed(self, rows: int, stated: bool) -> None:
        """Count linear moves that were read at once. stated: a motion code stands in them."""
        self._blocks += rows
        self._idle, self._motions = 0, len(self.reader.record)
        if stated:
            self.reader.forget_cycle()

    def _end_of_tape(self) -> int:
        """Number of valid rows: if the first line is a `%`, those before the next one."""
        for row in range(len(self.text)):
            stripped = self.text.line(row).strip(BLANK)
            if stripped.startswith("%"):
                signs = (other for other in self.text.rows_with("%") if other > row)
                ends = (other for other in signs if self.text.line(other).strip(BLANK).startswith("%"))
                return next(ends, len(self.text))
            if stripped and code_of(stripped).strip(BLANK):
                break
        return len(self.text)

    def step(self, row: int) -> int | None:
        """Execute line `row`, and return the next row, None at the end."""
        if self.text.line(row).lstrip(BLANK).startswith("%"):
            self._traced(row, Line([]))
            return row + 1
        return None if self.execute(row) else row + 1

    def execute(self, row: int) -> bool:
        """Execute an ordinary line; True when the program ends there."""
        line = self.parsed(row)
        self._count(row)
        reader = self.reader
        if line.deleted and reader.state.setup.skip_deleted:
            self._traced(row, Line([]))
            return False
        words = self.computed(row, line)
        if line.settings:
            self._assign(row, line)
        self._traced(row, line, words)
        if not words:
            return False
        block = reader.sort(row, words)
        if line.warning:
            reader.warn(line.warning)
        if not (block.g or block.m or block.words):
            return False
        return reader.perform(block)

    def _traced(self, row: int, line: Line, words: list[Word] | None = None) -> None:
        if self.trace is not None:
            self.trace.motions = len(self.reader.record)
            self.trace.line(row, line, words or line.words)

    def _remarked(self, row: int) -> None:
        if self.trace is not None:
            self.trace.motions = len(self.reader.record)
            self.trace.remark(row)

    def _count(self, row: int) -> None:
        """Count executed lines, and refuse a program with an endless loop."""
        self._blocks += 1
        motions = len(self.reader.record)
        self._idle = self._idle + 1 if motions == self._motions else 0
        self._motions = motions
        if not self.reader.straight and (self._blocks > _MOST_BLOCKS or self._idle > _MOST_IDLE):
            self.refuse(row, 0, "CC126", "the program comes to no end here")

    # --- lines and expressions ---------------------------------------------------------------------------------

    def refuse(self, row: int, column: int, rule: str, message: str) -> NoReturn:
        """Raise a ProgramError at a character."""
        raise ProgramError(rule, message, at=self.text.place(row, column))

    def parsed(self, row: int) -> Line:
        """Words of a line, cached for repetitions."""
        line = self._lines.get(row)
        if line is None:
            line = self._read(row)
            if line.expressions or line.settings or any(word.mode for word in line.words):
                self.reader.straight = False
            if not self.reader.straight:
                self._lines[row] = line
        return line

    def _read(self, row: int) -> Line:
        return read_line(self.text, row, self.spelling)

    def value(self, row: int, expression: Expression) -> float:
        """Present value of an expression."""
        self.memory.row = row
        try:
            return self.memory.value(expression)
        except ExpressionError as error:
            self.refuse(row, error.column, "CC123", error.message)

    def computed(self, row: int, line: Line) -> list[Word]:
        """The line's words with the values of their expressions, and with increments counted."""
        words = line.words
        if line.expressions:
            words = list(words)
            for index, expression in line.expressions:
                words[index] = words[index]._replace(value=self.value(row, expression))
            # A word with a vacant variable counts as missing (Fanuc).
            words = [word for word in words if not math.isnan(word.value)]
        if self.reader.dialect.increments:
            words = self._scaled(row, line, words)
        return words

    def _scaled(self, row: int, line: Line, words: list[Word]) -> list[Word]:
        increment = self.reader.state.setup.increment_mm
        source = self.text.line(row)
        # In inch, controls count in a tenth of the metric figure: 0.001 mm, 0.0001 inch.
        stated = [word.value for word in words if word.letter == "G" and word.value in (20.0, 21.0)]
        inch = stated[0] == 20.0 if stated else self.reader.state.unit != 1.0
        exact = {line.words[index].begin for index, _ in line.expressions}
        for index, word in enumerate(words):
            if word.letter not in _INCREMENTAL_LETTERS or word.begin in exact or word.value == 0.0:
                continue
            if "." in source[word.begin : word.end]:
                continue
            if increment is None:
                self.reader.block.row = row
                unit, small = ("inch", 0.001) if inch else ("mm", 0.01)
                text = (
                    f"numbers without a point are read as {unit}, X10 as 10 {unit}; a controller that counts increments "
                    f"reads {small} {unit}: if yours does, state `control: {{input_increment_mm: 0.001}}`"
                )
                self.reader.warn(text, once=True)
                return words
            words = [*words]
            words[index] = word._replace(value=word.value * (increment / 10.0 if inch else increment))
        return words

    def _assign(self, row: int, line: Line) -> None:
        # All values are computed before any parameter changes, so that `#1=#2 #2=#1` swaps.
        self.reader.straight = False
        found = [(each, self.value(row, each.value)) for each in line.settings]
        for each, value in found:
            try:
                self.memory.assign(each.target, value)
            except ExpressionError as error:
                self.refuse(row, error.column or each.begin, "CC123", error.message)


class Siemens(Flow):
    """Sinumerik: another spelling of lines; jumps and loops are refused when they are read."""

    def _read(self, row: int) -> Line:
        line = read_siemens_line(self.text, row)
        words = [value for _, value in line.expressions]
        for each in line.settings:
            # In `R1=R1+1` the value is computed first; `R1=2 R2=R1` is ambiguous and refused.
            others = [other.value for other in line.settings if other is not each] + words
            if any(each.target[1][:2] == used for value in others for used in parameters_of(value)):
                self.refuse(row, each.begin, "CC123", "a parameter is set and used in one block")
        return line
