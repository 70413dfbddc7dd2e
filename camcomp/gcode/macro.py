"""Subprograms of M97, M98 and M99, and Fanuc's custom macro B: jumps, loops, G65."""

import re

from camcomp.gcode.block import BlockReader
from camcomp.gcode.expressions import Expression, ExpressionError, Parser
from camcomp.gcode.flow import Flow
from camcomp.gcode.memory import CallFrame
from camcomp.gcode.trace import Trace
from camcomp.gcode.words import Word, code_of

_PROGRAM = re.compile(r"[ \t\0]*[O:][ \t]*(\d+)[ \t\0]*(?:\(|;|$)", re.IGNORECASE)
_NUMBER = re.compile(r"[ \t\0]*/?\d?[ \t]*N[ \t]*(\d+)", re.IGNORECASE)
_JUMP_WORD = re.compile(r"[ \t\0]*/?(?:N[ \t]*\d+[ \t]*)?(IF|WHILE|DO|END|GOTO)(?![A-Z])", re.IGNORECASE)
_END_CODE = re.compile(r"M[ \t]*0*(?:2|30)(?!\d)", re.IGNORECASE)
# Parameters that the arguments of G65 become.
_ARGUMENTS = dict(zip("ABCIJKDEFHMQRSTUVWXYZ", (*range(1, 10), 11, 13, *range(17, 27)), strict=True))
_DEEPEST = 100


class Subprograms(Flow):
    """M98 and M99, with the subprograms in the same file; Q of M98 and M97 exist on Fanuc and related controllers."""

    words_of_m98 = frozenset("PL")

    def __init__(self, reader: BlockReader, trace: Trace | None = None) -> None:
        super().__init__(reader, trace)
        self._programs: dict[int, int] = {}
        self._returns: list[tuple[int, int, int]] = []  # row of the call, first executed row, remaining passes
        self._called: set[int] = set()
        if re.search(r"M[ \t]*0*9[789]", self.text.string, re.IGNORECASE):
            self._find_programs()

    def _find_programs(self) -> None:
        if "O" not in self.text.string and "o" not in self.text.string and ":" not in self.text.string:
            return
        for row in range(self.rows):
            found = _PROGRAM.match(self.text.line(row))
            if found:
                self._programs.setdefault(int(found[1]), row)

    def step(self, row: int) -> int | None:
        """Execute line `row`, and return the next row, None at the end."""
        line = self.text.line(row)
        if "9" in line and ("m" in line or "M" in line):
            code = self._subprogram_code(row)
            if code is not None:
                return self._subprogram(row, code)
        return super().step(row)

    def _subprogram_code(self, row: int) -> int | None:
        line = self.parsed(row)
        if line.deleted and self.reader.state.setup.skip_deleted:
            return None
        for word in line.words:
            if word.letter == "M" and word.value in (97.0, 98.0, 99.0):
                return int(word.value)
        return None

    def _subprogram(self, row: int, code: int) -> int | None:
        self._count(row)
        self.reader.straight = False
        words = self.computed(row, self.parsed(row))
        values = {word.letter: word for word in words if word.letter not in "NM"}
        known = self.words_of_m98 if code == 98 else frozenset("PL" if code == 97 else "P")
        strange = [word for letter, word in values.items() if letter not in known]
        if strange or len([word for word in words if word.letter == "M"]) > 1:
            self.refuse(
                row, (strange or words)[0].begin, "CC124", f"M{code} stands alone with {' and '.join(sorted(known))}"
            )
        self._remarked(row)
        if code == 99:
            return self._back(row, values.get("P"))
        for letter, word in values.items():
            if word.value != int(word.value) or word.value < 0.0:
                self.refuse(row, word.begin, "CC124", f"{letter} of M{code} is a whole number")
        if "P" not in values:
            what = "line" if code == 97 else "program"
            self.refuse(row, words[0].begin, "CC124", f"M{code} needs the number of a {what} as P")
        number, passes = int(values["P"].value), int(values["L"].value) if "L" in values else 1
        if code == 97:
            return self._local(row, values["P"], passes)
        start = self._programs.get(number)
        if start is None and number > 9999 and "L" not in values:
            # Older controls write repeats and number together: P30100 is three times O0100.
            passes, number = number // 10000, number % 10000
            start = self._programs.get(number)
        if start is None:
            self.refuse(row, values["P"].begin, "CC125", f"program O{number} is not in this file")
        first = start + 1
        if "Q" in values:
            first = self._numbered(row, values["Q"].begin, int(values["Q"].value), start, f"program O{number}")
        return self._enter(row, start, passes, first)

    def _local(self, row: int, target: Word, passes: int) -> int:
        """M97 of Haas: a part of the same program, from line N to M99."""
        self.refuse(row, target.begin, "CC124", "M97 is not followed in this dialect")

    def _program_rows(self, row: int) -> tuple[int, int]:
        """First row of the program around `row`, and of the program after it."""
        starts = [0, *sorted(self._programs.values()), self.rows]
        first = max(each for each in starts if each <= row)
        return first, min(each for each in starts if each > row)

    def _numbered(self, row: int, column: int, number: int, inside: int, name: str) -> int:
        """Row of line N`number` of the program around row `inside`, searched from there on and then from its start."""
        first, last = self._program_rows(inside)
        rows: list[int] = [*range(inside, last), *range(first, inside)]
        for other in rows:
            found = _NUMBER.match(self.text.line(other))
            if found and int(found[1]) == number:
                return other
        self.refuse(row, column, "CC124", f"there is no line N{number} in {name}")

    def _enter(self, row: int, start: int, passes: int, first: int) -> int:
        """Call from `row` the program that begins at `start`, and execute it `passes` times from row `first` on."""
        if len(self._returns) >= _DEEPEST:
            self.refuse(row, 0, "CC126", "subprograms call each other without end")
        self._called.add(start)
        if passes < 1:
            return row + 1
        self._returns.append((row, first, passes - 1))
        return first

    def _back(self, row: int, target: Word | None) -> int | None:
        """M99: repeat for the remaining passes, then return behind the call; in the main program it ends the run."""
        if not self._returns:
            self.reader.block.row = row
            self.reader.warn("M99 ends the main program: controls begin it again, and the corrected program runs once")
            return None
        if target is not None:
            self.refuse(row, target.begin, "CC124", "M99 with P is not followed")
        call, first, left = self._returns.pop()
        if left > 0:
            self._returns.append((call, first, left - 1))
            self._again_from(call)
            return first
        self._left_program(call)
        return call + 1

    def _left_program(self, call: int) -> None:
        """Restore the parameters after the subprogram of `call`."""

    def _again_from(self, call: int) -> None:
        """Reset the parameters for a repetition of the subprogram of `call`."""


class Macro(Subprograms):
    """Fanuc custom macro B."""

    words_of_m98 = frozenset("PLQ")

    def __init__(self, reader: BlockReader, trace: Trace | None = None) -> None:
        super().__init__(reader, trace)
        self._framed: dict[int, dict[int, float]] = {}  # arguments by row of the call
        self._find_programs()

    def run(self) -> None:
        """Execute from the first line to the program's end."""
        super().run()
        first = min(self._programs.values(), default=0)
        for number, row in self._programs.items():
            if row == first or row in self._called:
                continue
            _, last = self._program_rows(row)
            if any(_END_CODE.search(code_of(self.text.line(other))) for other in range(row, last)):
                self.refuse(row, 0, "CC136", f"O{number} is a program of its own, and is not called")

    def step(self, row: int) -> int | None:
        """Execute line `row`, and return the next row, None at the end."""
        line = self.text.line(row)
        found = _JUMP_WORD.match(line)
        if found:
            return self._jump(row, found[1].upper(), found.end())
        if "65" in line and "G" in line.upper():
            words = self.parsed(row).words
            if any(word.letter == "G" and word.value == 65.0 for word in words):
                return self._call(row)
        return super().step(row)

    def _local(self, row: int, target: Word, passes: int) -> int:
        """M97 of Haas: a part of the same program, from line N to M99."""
        first = self._numbered(row, target.begin, int(target.value), row, "this program")
        return self._enter(row, self._program_rows(row)[0], passes, first)

    def _jump(self, row: int, keyword: str, end: int) -> int:
        assert self.spelling is not None
        self._count(row)
        self.reader.straight = False
        self._remarked(row)
        parser = Parser(code_of(self.text.line(row)).rstrip("\0 \t\x1a"), end, self.spelling)
        try:
            if keyword == "GOTO":
                return self._goto(row, parser.value())
            if keyword in ("IF", "WHILE"):
                condition = self.value(row, parser.group())
                rest = code_of(self.text.line(row))[parser.at :].strip().upper()
                parser.blank()
                if keyword == "WHILE":
                    return self._while(row, condition != 0.0, rest)
                return self._if(row, condition != 0.0, rest, parser)
            number = self._loop_number(row, parser)
        except ExpressionError as error:
            self.refuse(row, error.column, "CC124", error.message)
        if keyword == "DO":
            return row + 1
        return self._again(row, number)

    def _if(self, row: int, true: bool, rest: str, parser: Parser) -> int:
        if rest.startswith("GOTO"):
            parser.at += 4
            return self._goto(row, parser.value()) if true else row + 1
        if rest.startswith("THEN"):
            parser.at += 4
            parser.blank()
            target = parser.parameter()
            if parser.blank() != "=":
                parser.fail("'=' is missing")
            parser.at += 1
            value = parser.expression(0)
            if true:
                self.memory.assign(target, self.value(row, value))
            return row + 1
        return parser.fail("IF is followed by GOTO or THEN")

    def _goto(self, row: int, expression: Expression) -> int:
        number = self.value(row, expression)
        if number != int(number):
            self.refuse(row, 0, "CC124", f"GOTO: N{number:g} is no line number")
        return self._numbered(row, 0, int(number), row, "this program")

    def _loop_number(self, row: int, parser: Parser) -> int:
        number = parser.number() if parser.blank().isdigit() else parser.fail("DO and END need a number")
        return int(number[1])

    def _while(self, row: int, true: bool, rest: str) -> int:
        found = re.match(r"DO\s*(\d+)$", rest)
        if not found:
            self.refuse(row, 0, "CC124", "WHILE needs DO and a number")
        if true:
            return row + 1
        return self._partner(row, int(found[1]), 1) + 1

    def _again(self, row: int, number: int) -> int:
        return self._partner(row, number, -1)

    def _partner(self, row: int, number: int, step: int) -> int:
        """Row of the END of a DO (step 1), or of the DO of an END (step -1)."""
        first, last = self._program_rows(row)
        wanted = rf"[ \t\0]*/?(?:N[ \t]*\d+[ \t]*)?END[ \t]*{number}\b" if step > 0 else rf"\bDO[ \t]*{number}\b"
        other = row + step
        while first <= other < last:
            line = code_of(self.text.line(other))
            if re.match(wanted, line, re.IGNORECASE) if step > 0 else re.search(wanted, line, re.IGNORECASE):
                return other
            other += step
        self.refuse(row, 0, "CC124", f"{'DO' if step > 0 else 'END'} {number} has no partner")

    def _call(self, row: int) -> int:
        """G65: a subprogram with arguments."""
        self._count(row)
        self.reader.straight = False
        self._remarked(row)
        words = [word for word in self.computed(row, self.parsed(row)) if word.letter != "N"]
        values: dict[str, Word] = {}
        for word in words:
            if word.letter == "G" and word.value == 65.0:
                continue
            if word.letter in values or word.letter in "GO":
                self.refuse(row, word.begin, "CC124", "this form of arguments of G65 is not followed")
            values[word.letter] = word
        number = values.pop("P", None)
        repeats = values.pop("L", None)
        start = self._programs.get(int(number.value)) if number else None
        if start is None:
            self.refuse(row, words[0].begin, "CC125", "the program that G65 calls is not in this file")
        arguments = {_ARGUMENTS[letter]: word.value for letter, word in values.items() if letter in _ARGUMENTS}
        if repeats is not None and not 1 <= repeats.value == int(repeats.value):
            self.refuse(row, repeats.begin, "CC124", "L of G65 counts calls, 1 or more")
        self.memory.frames.append(CallFrame(dict(arguments)))
        self._framed[row] = arguments
        return self._enter(row, start, int(repeats.value) if repeats else 1, start + 1)

    def _left_program(self, call: int) -> None:
        if call in self._framed and len(self.memory.frames) > 1:
            self.memory.frames.pop()

    def _again_from(self, call: int) -> None:
        if call in self._framed:
            self.memory.frames[-1] = CallFrame(dict(self._framed[call]))
