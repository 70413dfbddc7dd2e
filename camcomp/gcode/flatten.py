"""Loops, subprograms, parameters and canned cycles written out as plain code, line by line as they were executed.

A line inside a loop means many motions with different corrections, so that such a program is written out before it is
changed. Comments are kept; jumps, calls and cycles become comments.
"""

import numpy as np

from camcomp.gcode.edits import Edits
from camcomp.gcode.interpret import Interpreter, controller, read_program
from camcomp.gcode.numbers import plain
from camcomp.gcode.program import Program
from camcomp.gcode.trace import Executed, Trace
from camcomp.gcode.words import BLANK, Word, code_of
from camcomp.ground.errors import ProgramError

_LENGTHS = "XYZIJKRQ"
_CYCLE_WORDS = "XYZIJKRPQL"
_SPARE_DIGITS = 2  # beyond the resolution, so that writing out does not round


def flatten(program: Program, resolution_mm: float) -> Program:
    """Program with the same motions without jumps, parameters and cycles.

    Raises ProgramError CC137 for a motion that cannot be written as G0 or G1 (tapping), or would end elsewhere.
    """
    trace = Trace()
    reader = Interpreter(program.text, program.setup, program.language)
    controller(reader, trace).run()
    string = Printer(program, reader, trace, resolution_mm).run()
    data = program.text.encode(string)
    flat = read_program(data, name=program.name, setup=program.setup, dialect=program.dialect)
    same = len(flat.path) == len(program.path) and bool((flat.path.kind == program.path.kind).all())
    half = 0.5 * program.step_mm(resolution_mm) * (1.0 + 1e-9)
    if not same or np.abs(flat.path.end - program.path.end).max() > half:
        raise ProgramError("CC137", "the program cannot be written out without loops", at=program.text.place(0))
    return flat


class Printer:
    """Writer of the text of the executed lines."""

    def __init__(self, program: Program, reader: Interpreter, trace: Trace, resolution_mm: float) -> None:
        self.program, self.reader, self.trace = program, reader, trace
        self.text = program.text
        self.resolution = resolution_mm
        self.seen: set[int] = set()
        self.code: float | None = None  # motion code outside of cycles

    def run(self) -> str:
        """The whole text."""
        lines: list[str] = []
        for entry in self.trace.entries:
            lines += (each + self.text.end_of_line(entry.row) for each in self._entry(entry))
        lines += self._tail()
        return "".join(lines)

    def _tail(self) -> list[str]:
        """The `%` that closes the file."""
        last = self.trace.entries[-1].row
        for row in range(len(self.text) - 1, last, -1):
            line = self.text.line(row)
            if line.strip(BLANK).startswith("%"):
                return [self.text.string[self.text.starts[row] : self.text.nexts[row]]]
        return []

    def _code(self, line: str) -> str:
        return code_of(line, self.program.language.brackets_comment)

    def _digits(self, unit: float) -> int:
        return self.program.language.digits(self.resolution * 10.0**-_SPARE_DIGITS, unit)

    def _entry(self, entry: Executed) -> list[str]:
        repeated = entry.row in self.seen
        self.seen.add(entry.row)
        if entry.remark:
            return [] if repeated else self._remark(entry.row)
        cycle = self.reader.record.cycles.get(entry.motions)
        # A line without a motion has the same count of motions before it as the cycle that follows.
        if cycle is not None and self.program.sites.row[entry.motions] == entry.row:
            actions, irreplaceable = cycle
            if irreplaceable:
                place = self.text.place(entry.row)
                raise ProgramError("CC137", f"{irreplaceable} cannot be replaced by straight moves", at=place)
            changed = self._changed(entry, repeated, cycle=True)
            head = [changed] if self._code(changed).strip(BLANK) else self._remark(entry.row)
            return head + self._moves(entry.motions, actions)
        changed = self._changed(entry, repeated, cycle=False)
        emptied = bool(entry.line.settings) and not self._code(changed).strip(BLANK)
        if emptied:
            return [] if repeated else self._remark(entry.row)
        return [changed]

    def _remark(self, row: int) -> list[str]:
        """The line as a comment, with the comments that it had."""
        line = self.text.line(row)
        bare = self._code(line)
        code = bare.strip(BLANK)
        if not code:
            return [line.strip(BLANK)] if line.strip(BLANK) else []
        opening, closing = self.program.language.comment
        spans = "".join(char if char != blank else " " for char, blank in zip(line, bare, strict=True)).split("  ")
        remarks = [each.strip(BLANK) for each in spans if each.strip(BLANK)]
        if opening == "(":
            code = " ".join(code.translate({ord("("): None, ord(")"): None}).split())
        return [" ".join([f"{opening}{code}{closing}", *remarks])]

    def _changed(self, entry: Executed, repeated: bool, cycle: bool) -> str:
        """The line with values instead of expressions; without its number in repetitions."""
        line = self.text.line(entry.row)
        edits = Edits()
        unit = self._unit(entry.motions)
        computed = {entry.line.words[index].begin for index, _ in entry.line.expressions}
        executed = {word.begin for word in entry.words}
        vacant = [word for word in entry.line.words if word.begin not in executed]
        for word in vacant:
            edits.replace(word.begin, self._behind(line, word.end), "")
        stated = [word.value for word in entry.words if word.letter == "G" and word.value in (0.0, 1.0, 2.0, 3.0)]
        self.code = stated[-1] if stated else self.code
        apart = self.program.language.cycles_apart and not stated and self.code is not None
        for index, word in enumerate(entry.words):
            if apart and word.letter == "G" and word.value == 80.0:  # the moves of the cycle have their own code
                edits.replace(word.begin, word.end, f"G{self.code:.0f}")
                continue
            gone = word.letter == "N" and (repeated or index > 0)
            if cycle:
                gone = gone or word.letter in _CYCLE_WORDS or (word.letter == "G" and self._is_cycle_code(word))
            if gone:
                edits.replace(word.begin, self._behind(line, word.end), "")
            elif word.begin in computed or word.mode:
                edits.replace(word.begin, word.end, self._number(entry, word, line, unit))
        for setting in entry.line.settings:
            edits.replace(setting.begin, self._behind(line, setting.end), "")
        return edits.apply(line)

    def _number(self, entry: Executed, word: Word, line: str, unit: float) -> str:
        """The word with its value in the modes in force."""
        point = word.letter in _LENGTHS
        value = word.value
        if word.mode and word.letter in "XYZIJK":
            sites, path, k = self.program.sites, self.program.path, entry.motions
            axis = "XYZIJK".index(word.letter) % 3
            place = (path.end if word.letter in "XYZ" else path.centre)[k, axis]
            relative = sites.relative[k] if word.letter in "XYZ" else not sites.centre_absolute[k]
            value = float(place - (path.start[k, axis] if relative else sites.offset[k, axis])) / unit
        address = line[word.begin : word.end].split("=")[0]
        long = len(address.strip()) > 1 and "=" in line[word.begin : word.end]
        number = plain(value, self._digits(unit) if point else 6, point)
        return f"{address}={number}" if long else word.letter + number

    @staticmethod
    def _is_cycle_code(word: Word) -> bool:
        return 73 <= word.value < 90 or word.value in (98.0, 99.0)

    @staticmethod
    def _behind(line: str, end: int) -> int:
        while end < len(line) and line[end] in " \t":
            end += 1
        return end

    def _unit(self, motion: int) -> float:
        sites = self.program.sites
        return float(sites.unit[min(motion, len(sites.unit) - 1)])

    def _moves(self, motion: int, actions: list[tuple[str, list[float]]]) -> list[str]:
        """Actions of a cycle as G0, G1, G4 and M statements."""
        sites, path = self.program.sites, self.program.path
        unit, offset, relative = float(sites.unit[motion]), sites.offset[motion], bool(sites.relative[motion])
        digits = self._digits(unit)
        here = [round(float(each), digits) for each in (path.start[motion] - offset) / unit]
        lines = []
        for statement, end in actions:
            if not end:
                lines.append(statement)
                continue
            there = [round(float(each), digits) for each in (np.array(end) - offset) / unit]
            axes = [axis for axis in range(3) if there[axis] != here[axis]] or [2]
            values = [there[axis] - here[axis] if relative else there[axis] for axis in axes]
            words = ["XYZ"[axis] + plain(value, digits) for axis, value in zip(axes, values, strict=True)]
            lines.append(" ".join([statement, *words]))
            here = there
        return lines
