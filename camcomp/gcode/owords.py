"""O-words of RS274: subroutines, loops, conditions."""

import re
from typing import NamedTuple

from camcomp.gcode.block import BlockReader
from camcomp.gcode.expressions import ExpressionError, Parser
from camcomp.gcode.macro import Subprograms
from camcomp.gcode.memory import CallFrame
from camcomp.gcode.trace import Trace
from camcomp.gcode.words import Line, code_of

_STATEMENT = re.compile(
    r"[ \t\0]*(/[ \t]*)?(?:N[ \t]*\d+[ \t]*)?O[ \t]*(\d+|<[^>]*>)[ \t]*"
    r"(endsub|endwhile|endrepeat|endif|sub|call|return|if|elseif|else|while|do|repeat|break|continue)(?![a-z])",
    re.IGNORECASE,
)
_DYNAMIC = re.compile(r"[ \t\0]*(?:N[ \t]*\d+[ \t]*)?O[ \t]*[#\[]", re.IGNORECASE)
_NAMED = re.compile(r"[ \t\0]*O[ \t]*<[^>]*>[ \t\0]*(\(|;|$)", re.IGNORECASE)
_DEEPEST = 100


class Statement(NamedTuple):
    """An O-word line: its label, its keyword, and where the keyword ends."""

    label: str
    keyword: str
    end: int


class Call(NamedTuple):
    """Return address of a subroutine."""

    row: int
    name: str


class OWords(Subprograms):
    """Flow of a program with O-words; the partner of every statement is found by its label beforehand."""

    def __init__(self, reader: BlockReader, trace: Trace | None = None) -> None:
        super().__init__(reader, trace)
        self._statements: dict[int, Statement] = {}
        self._subs: dict[str, int] = {}
        self._partner: dict[int, int] = {}  # loop start -> end, if -> next branch, sub -> endsub, and loop end -> start
        self._calls: list[Call] = []
        self._repeats: dict[tuple[int, int], int] = {}  # (depth, row of repeat) -> remaining passes
        self._taken: set[tuple[int, int]] = set()  # (depth, row of endif) with an executed branch
        if "o" in self.text.string.lower():
            self._scan()

    def _scan(self) -> None:
        opened: dict[str, list[int]] = {}
        for row in self.text.rows_with("[oO]"):
            found = _STATEMENT.match(code_of(self.text.line(row)))
            if row >= self.rows or found is None:
                continue
            label = "".join(found[2].split()).lower()
            label = label.lstrip("0") or "0" if label.isdigit() else label
            keyword = found[3].lower()
            self._statements[row] = Statement(label, keyword, found.end())
            self._pair(row, label, keyword, opened.setdefault(label, []))

    def _pair(self, row: int, label: str, keyword: str, stack: list[int]) -> None:
        kind = self._statements[stack[-1]].keyword if stack else ""
        if keyword == "sub":
            self._subs.setdefault(label, row)
            stack.append(row)
        elif keyword in ("do", "repeat", "if") or (keyword == "while" and kind != "do"):
            stack.append(row)
        elif keyword in ("elseif", "else") and kind in ("if", "elseif"):
            self._partner[stack.pop()] = row
            stack.append(row)
        elif keyword == "endif" and kind in ("if", "elseif", "else"):
            self._partner[stack.pop()] = row
        elif (keyword, kind) in (
            ("endsub", "sub"),
            ("endwhile", "while"),
            ("while", "do"),
            ("endrepeat", "repeat"),
        ):
            start = stack.pop()
            self._partner[start], self._partner[row] = row, start

    def _end_of_if(self, row: int) -> int:
        while self._statements[row].keyword != "endif":
            row = self._match(row)
        return row

    def _match(self, row: int) -> int:
        partner = self._partner.get(row)
        if partner is None:
            self.refuse(
                row, 0, "CC124", f"o{self._statements[row].label} {self._statements[row].keyword} has no partner"
            )
        return partner

    # --- execution ---------------------------------------------------------------------------------------------

    def step(self, row: int) -> int | None:
        """Execute line `row`, and return the next row, None at the end."""
        statement = self._statements.get(row)
        if statement is None:
            if _NAMED.match(self.text.line(row)):
                self._remarked(row)
                return row + 1
            if not _DYNAMIC.match(self.text.line(row)):
                return super().step(row)
            statement = self._computed_call(row)
        self._count(row)
        self.reader.straight = False
        self._remarked(row)
        if self.reader.state.setup.skip_deleted and self.text.line(row).lstrip().startswith("/"):
            return row + 1
        self.memory.row = row
        out: int | None = getattr(self, f"_do_{statement.keyword}")(row, statement)
        return out

    def _computed_call(self, row: int) -> Statement:
        """`o[#1] call`: the label is the value of an expression."""
        assert self.spelling is not None
        code = code_of(self.text.line(row)).rstrip()
        parser = Parser(code, re.match(r"[^oO]*[oO]", code).end(), self.spelling)  # type: ignore[union-attr]
        try:
            label = parser.value()
        except ExpressionError as error:
            self.refuse(row, error.column, "CC124", error.message)
        parser.blank()
        if code[parser.at : parser.at + 4].lower() != "call":
            self.refuse(row, parser.at, "CC124", "only a call may have a label that is computed")
        return Statement(f"{self.value(row, label):.0f}", "call", parser.at + 4)

    def _groups(self, row: int, statement: Statement) -> list[float]:
        """Values of the bracketed groups behind the keyword."""
        assert self.spelling is not None
        parser = Parser(code_of(self.text.line(row)).rstrip(), statement.end, self.spelling)
        values = []
        try:
            while parser.blank():
                values.append(parser.group())
        except ExpressionError as error:
            self.refuse(row, error.column, "CC124", error.message)
        except RecursionError:
            self.refuse(row, statement.end, "CC124", "the expression is nested too deeply")
        return [self.value(row, each) for each in values]

    def _condition(self, row: int, statement: Statement) -> float:
        values = self._groups(row, statement)
        if len(values) != 1:
            self.refuse(row, statement.end, "CC124", f"{statement.keyword} needs one expression in brackets")
        return values[0]

    def _depth(self) -> int:
        return len(self._calls)

    def _do_sub(self, row: int, statement: Statement) -> int:
        return self._match(row) + 1

    def _do_call(self, row: int, statement: Statement) -> int:
        start = self._subs.get(statement.label)
        if start is None:
            self.refuse(row, 0, "CC125", f"subroutine o{statement.label} is not in this program")
        values = self._groups(row, statement)
        if len(values) > 30:
            self.refuse(row, statement.end, "CC124", "a call has at most 30 arguments")
        if len(self._calls) >= _DEEPEST:
            self.refuse(row, 0, "CC126", "subroutines call each other without end")
        self._calls.append(Call(row + 1, statement.label))
        self.memory.frames.append(CallFrame({number + 1: value for number, value in enumerate(values)}))
        return start + 1

    def _return(self, row: int, statement: Statement) -> int:
        values = self._groups(row, statement)
        strange = statement.keyword == "endsub" and self._calls and self._calls[-1].name != statement.label
        if not self._calls or strange:
            self.refuse(row, 0, "CC124", f"o{statement.label} {statement.keyword} stands outside its subroutine")
        self.memory.set_named("_value", values[0] if values else 0.0)
        self.memory.set_named("_value_returned", float(bool(values)))
        depth = self._depth()
        self._repeats = {key: left for key, left in self._repeats.items() if key[0] < depth}
        self._taken = {key for key in self._taken if key[0] < depth}
        self.memory.frames.pop()
        return self._calls.pop().row

    def _do_endsub(self, row: int, statement: Statement) -> int:
        return self._return(row, statement)

    def _do_return(self, row: int, statement: Statement) -> int:
        return self._return(row, statement)

    def _do_if(self, row: int, statement: Statement) -> int:
        end = (self._depth(), self._end_of_if(row))
        self._taken.discard(end)
        return self._branch(row, end, self._condition(row, statement) != 0.0)

    def _branch(self, row: int, end: tuple[int, int], true: bool) -> int:
        if true:
            self._taken.add(end)
            return row + 1
        following = self._match(row)
        # The next branch is evaluated when it is reached; `else` and `endif` are skipped.
        return following

    def _do_elseif(self, row: int, statement: Statement) -> int:
        end = (self._depth(), self._end_of_if(row))
        if end in self._taken:
            return end[1]
        return self._branch(row, end, self._condition(row, statement) != 0.0)

    def _do_else(self, row: int, statement: Statement) -> int:
        end = (self._depth(), self._end_of_if(row))
        return end[1] if end in self._taken else self._branch(row, end, True)

    def _do_endif(self, row: int, statement: Statement) -> int:
        self._taken.discard((self._depth(), row))
        return row + 1

    def _do_while(self, row: int, statement: Statement) -> int:
        partner = self._match(row)
        true = self._condition(row, statement) != 0.0
        if partner < row:  # end of do ... while
            return partner + 1 if true else row + 1
        return row + 1 if true else partner + 1

    def _do_endwhile(self, row: int, statement: Statement) -> int:
        return self._match(row)

    def _do_do(self, row: int, statement: Statement) -> int:
        self._match(row)
        return row + 1

    def _do_repeat(self, row: int, statement: Statement) -> int:
        left = int(self._condition(row, statement) + 0.5)
        end = self._match(row)
        self._repeats[self._depth(), row] = left
        return row + 1 if left > 0 else end + 1

    def _do_endrepeat(self, row: int, statement: Statement) -> int:
        key = (self._depth(), self._match(row))
        left = self._repeats.get(key, 0) - 1
        self._repeats[key] = left
        return key[1] + 1 if left > 0 else row + 1

    def _do_break(self, row: int, statement: Statement) -> int:
        return self._loop_around(row, statement)[1] + 1

    def _do_continue(self, row: int, statement: Statement) -> int:
        return self._loop_around(row, statement)[1]

    def _loop_around(self, row: int, statement: Statement) -> tuple[int, int]:
        for start in range(row - 1, -1, -1):
            other = self._statements.get(start)
            if other and other.label == statement.label and other.keyword in ("while", "do"):
                end = self._partner.get(start, -1)
                if end > row:
                    self._nothing_between(row, end, statement)
                    return start, end
        self.refuse(row, 0, "CC124", f"o{statement.label} {statement.keyword} stands outside a loop")

    def _nothing_between(self, row: int, end: int, statement: Statement) -> None:
        """Refuse another line of that label before the loop's end, which LinuxCNC would take for the end."""
        for other in range(row + 1, end):
            if other in self._statements and self._statements[other].label == statement.label:
                self.refuse(
                    row, 0, "CC124", f"another o{statement.label} line stands between this one and the loop's end"
                )

    def execute(self, row: int) -> bool:
        """Execute an ordinary line; True when the program ends there."""
        line = self.parsed(row)
        if self._calls and any(word.letter == "O" for word in line.words):
            line = Line([])
        return super().execute(row)
