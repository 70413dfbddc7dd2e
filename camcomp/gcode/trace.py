"""What a program did line by line, so that loops and subprograms can be written out as plain code."""

from typing import NamedTuple

from camcomp.gcode.words import Line, Word


class Executed(NamedTuple):
    """One line that was executed, or passed (a remark: jumps, calls, labels)."""

    row: int
    line: Line
    words: list[Word]
    remark: bool
    motions: int  # motions recorded before it


class Trace:
    """Collects executed lines in order."""

    def __init__(self) -> None:
        self.entries: list[Executed] = []
        self.motions = 0

    def line(self, row: int, line: Line, words: list[Word]) -> None:
        """An ordinary line is about to be executed."""
        self.entries.append(Executed(row, line, words, False, self.motions))

    def remark(self, row: int) -> None:
        """A line that only says where to go on."""
        self.entries.append(Executed(row, Line([]), [], True, self.motions))
