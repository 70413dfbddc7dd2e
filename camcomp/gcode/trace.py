"""Record of the executed lines of a program, for writing out loops and subprograms."""

from typing import NamedTuple

from camcomp.gcode.words import Line, Word


class Executed(NamedTuple):
    """One executed line, or a line of flow control (a remark: jumps, calls, labels)."""

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
        """Record an ordinary line before its execution."""
        self.entries.append(Executed(row, line, words, False, self.motions))

    def remark(self, row: int) -> None:
        """Record a line of flow control."""
        self.entries.append(Executed(row, Line([]), [], True, self.motions))
