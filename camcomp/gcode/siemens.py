"""Lines of Sinumerik programs as words: `X=IC(3)`, `CR=5`, `I=AC(10)`, R parameters, statements of several letters.

An address of several letters with the meaning of a letter in other dialects becomes that letter (CR is R, TURN is P), so
that all code behind the reader is independent of the dialect.
"""

import re
from typing import NoReturn

from camcomp.gcode.expressions import Expression, ExpressionError, Parser
from camcomp.gcode.spelling import SINUMERIK
from camcomp.gcode.text import Text
from camcomp.gcode.words import BLANK, Line, Setting, Word, refuse

_SIEMENS_NAME = re.compile(r"[A-Za-z_][A-Za-z_]*[0-9]*")
_SIEMENS_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")
_LABEL = re.compile(r"[ \t]*(?:N[0-9]+[ \t]+)?([A-Za-z_][A-Za-z0-9_]+):(?!=)")
_QUOTED = re.compile(r'"[^"]*"')

# Statements without influence on the path, with or without brackets behind them.
IGNORED = frozenset(
    """
    MSG STOPRE CYCLE832 WORKPIECE SOFT BRISK DRIVE FFWON FFWOF COMPOF COMPON COMPCURV COMPCAD
    COMPSURF CFC CFTCP CFIN CUTCONOF CUTCONON WALIMON WALIMOF DIAMOF DIAMCYCOF KONT NORM ORIWKS
    ORIVECT UPATH SPATH DISPLOF DISPLON SAVE EXTERN DYNNORM DYNPOS DYNROUGH DYNSEMIFIN DYNFINISH
    DYNPREC FNORM RTLION RTLIOF PUTFTOCF FTOCON FTOCOF G0EXT GROUP_BEGIN GROUP_END TOFFOF CDOF CPRECOF PTPG0
    CP BLSYNC ADISPOS ADIS FIFOCTRL STARTFIFO STOPFIFO LIMS SETMS
    """.split()  # noqa: SIM905
)
# Statements that switch a function off without arguments; with arguments they change coordinates.
RESETS = frozenset(
    """
    TRANS ATRANS ROT AROT SCALE ASCALE MIRROR AMIRROR CYCLE800 MCALL ROTS AROTS CROT CROTS
    """.split()  # noqa: SIM905
)
MACHINE = frozenset(("SUPA",))
# Refused statements with rule, reason and hint. The first matching pattern counts.
_NOT_FOLLOWED: tuple[tuple[str, str, str, str], ...] = (
    ("A?TRANS|G5[89]", "CC118", "moves the coordinates, which is not followed", "put the shift into G54 or into the numbers"),
    ("A?ROTS?|CROTS?|ROTS|CYCLE800|TOROT.*|TOFRAME.*", "CC118", "turns the coordinates, which is not followed", "post unrotated"),
    ("A?SCALE|A?MIRROR", "CC117", "scales or mirrors, which is not followed", "post at full scale, without mirroring"),
    ("ORIMKS|ORIAXES|ORICURVE|ORICON.*", "CC115", "turns the tool in another way than on a great circle", "write ORIWKS and ORIVECT"),
    ("TRANSMIT|TRACYL|TRAANG", "CC115", "switches a transformation on, which is not followed", "post for three axes"),
    ("(CYCLE|POCKET|SLOT|HOLES)[0-9]+|LONGHOLE|MCALL", "CC132", "is a cycle of the control, which is not followed",
     "post the motions instead of the cycle"),
    ("CIP|CT", "CC112", "is an arc in a form that is not followed", "post arcs with I, J, K or CR="),
    ("[ABC]SPLINE|POLY", "CC119", "is a spline", "post lines and arcs"),
    ("INVCW|INVCCW", "CC119", "is an involute", "post lines and arcs"),
)  # fmt: skip
_ADDRESSES = {"CR": "R", "TURN": "P", "FP": "P", "ADIS": "ADIS", "A3": "A3", "B3": "B3", "C3": "C3"}
_TRANSFORMS = {"TRAORI": 1.0, "TRAFOOF": 0.0}
MACHINE_AXIS = "1"  # mode of X1=, Y1=, Z1=
_ADDRESSES_NOT_FOLLOWED = (
    ("AP|RP", "CC116", "post in Cartesian coordinates"),
    ("AR|[IJK]1", "CC112", "post arcs with I, J, K or CR="),
    ("DISR|DISCL|DISC|OFFN", "CC114", "post the program with the tool's centre line (G40)"),
    ("CHF|CHR|RND|RNDM|ANG", "CC139", "post corners as arcs and lines"),
    ("FB|FRC|FRCM|FL|FGREF", "CC110", "write the feed as F"),
    ("[ABC][24-7]|LEAD|TILT|ROT[ABC]?", "CC115", "post the program for three axes"),
)
_FLOW = frozenset(
    """
    IF ELSE ENDIF WHILE ENDWHILE FOR ENDFOR LOOP ENDLOOP REPEAT REPEATB UNTIL GOTO GOTOF GOTOB GOTOC GOTOS
    CASE CALL PCALL DEF PROC RET
    """.split()  # noqa: SIM905
)


def code_end(line: str) -> int:
    """Index at which the comment of a line starts."""
    quoted = False
    for k, char in enumerate(line):
        if char == '"':
            quoted = not quoted
        elif char == ";" and not quoted:
            return k
    return len(line)


class SiemensLine:
    """Reader of one line."""

    def __init__(self, text: Text, row: int) -> None:
        self.text, self.row = text, row
        self.line = text.line(row)
        self.end = code_end(self.line)
        self.at = 0
        self.words: list[Word] = []
        self.expressions: list[tuple[int, Expression]] = []
        self.settings: list[Setting] = []
        self.deleted = False

    def read(self) -> Line:
        """Words of the line. Raises ProgramError with the location of an unreadable one."""
        code = self.line[: self.end]
        if code.strip(BLANK).startswith("%"):
            return Line([])
        label = _LABEL.match(code)
        if label:
            self.at = label.end()
        while self.at < self.end:
            char = self.line[self.at]
            if char in BLANK:
                self.at += 1
            elif char == "/" and not self.words:
                self.deleted = True
                self.at += 1
                while self.line[self.at : self.at + 1].isdigit():
                    self.at += 1
            elif char == ":" and not self.words:
                self.at += 1
                self._skip_digits()
            elif char.isascii() and (char.isalpha() or char == "_"):
                self._statement()
            else:
                self._refuse("CC107" if not char.isdigit() and char not in ".+-" else "CC103", self._why(char))
        approach = any(word.letter == "G" and word.value in (74.0, 75.0) for word in self.words)
        for word in self.words:
            if word.mode == MACHINE_AXIS and not approach:
                self._refuse(
                    "CC115", f"{word.letter}1 is an axis of the machine, which only G74 and G75 take here", word.begin
                )
        return Line(self.words, self.deleted, "", tuple(self.expressions), tuple(self.settings))

    def _why(self, char: str) -> str:
        if char.isdigit() or char in ".+-":
            return "number without a letter"
        return f"'{self.text.readable(char)}' has no meaning here"

    def _skip_digits(self) -> None:
        while self.line[self.at : self.at + 1].isdigit():
            self.at += 1

    def _refuse(self, rule: str, message: str, column: int | None = None, hint: str | None = None) -> NoReturn:
        refuse(
            text=self.text,
            row=self.row,
            column=self.at if column is None else column,
            rule=rule,
            message=message,
            hint=hint,
        )

    def _next(self, at: int) -> str:
        while at < self.end and self.line[at] in " \t":
            at += 1
        return self.line[at] if at < self.end else ""

    def _statement(self) -> None:
        start = self.at
        found = _SIEMENS_NAME.match(self.line, start, self.end)
        assert found is not None
        name = found[0].upper()
        letters = name.rstrip("0123456789")
        assigned = self._next(found.end()) == "=" and self.line[found.end() :].lstrip()[1:2] != "="
        if len(letters) == 1 and assigned and letters == "R" and name != "R":
            self._parameter(start)
        elif assigned:
            self._assigned(start, found.end(), name, letters)
        elif len(letters) == 1:
            self._plain(start, letters)
        elif name in _TRANSFORMS:
            self.words.append(Word("TRAORI", _TRANSFORMS[name], start, found.end()))
            self.at = found.end()
            self._skip_group()
        elif letters in IGNORED or name in IGNORED:
            self.at = found.end()
            self._skip_group()
        elif name in MACHINE:
            self.words.append(Word("G", 53.0, start, found.end()))
            self.at = found.end()
        elif name in RESETS:
            self._reset(start, found.end(), name)
        elif name in _FLOW or letters in _FLOW:
            self._refuse(
                "CC124",
                f"{name}: jumps, loops and variables are not followed",
                hint="write the lines out as they are executed",
            )
        else:
            self._refuse_statement(found[0], start)

    def _refuse_statement(self, name: str, start: int) -> NoReturn:
        for pattern, rule, reason, hint in _NOT_FOLLOWED:
            if re.fullmatch(pattern, name.upper()):
                self._refuse(rule, f"{name.upper()} {reason}", start, hint)
        self._refuse("CC135", f"'{name}' is no statement that camcomp knows", start)

    def _plain(self, start: int, letter: str) -> None:
        """A letter and its number."""
        at = start + 1
        while at < self.end and self.line[at] in " \t":
            at += 1
        found = _SIEMENS_NUMBER.match(self.line, at, self.end)
        if found is None:
            self._refuse("CC103", f"'{letter}' has no number")
        rest = self.line[found.end() : self.end].lstrip(" \t")[:1]
        if rest and rest in ".,0123456789":
            rule = "CC101" if rest == "," else "CC102"
            self._refuse(rule, f"'{self.line[start : found.end()]}{rest}' is not one number")
        if letter == "L":
            self._refuse("CC125", f"subprogram L{found[0]} is not followed", start, "write the subprogram's lines out")
        self.words.append(Word(letter, float(found[0]), start, found.end()))
        self.at = found.end()

    def _parameter(self, start: int) -> None:
        parser = Parser(self.line[: self.end], start, SINUMERIK)
        try:
            target = parser.parameter()
            if parser.blank() != "=":
                parser.fail("'=' is missing")
            parser.at += 1
            value = parser.expression(0)
        except ExpressionError as error:
            refuse(self.text, self.row, error.column, "CC123", error.message)
        self.settings.append(Setting(target, value, start, parser.behind()))
        self.at = parser.at

    def _assigned(self, start: int, name_end: int, name: str, letters: str) -> None:
        """`X=...`, `CR=...`, `T="..."`, `S1=...`."""
        equals = self.line.index("=", name_end)
        quoted = _QUOTED.match(self.line, equals + 1 + self._blanks(equals + 1))
        if quoted and letters == "T":
            self.at = quoted.end()
            return
        letter = _ADDRESSES.get(name)
        if letter is None and len(name) == 1:
            letter = name
        if letter is None and name in ("S1", "M1", "F1", "X1", "Y1", "Z1"):
            letter = name[0]
        if name in ("SPOS", "SPOSA", "ADISPOS", "FFWON", "OVR", "LIMS"):
            letter = ""
        if letter is None:
            for known, rule, hint in _ADDRESSES_NOT_FOLLOWED:
                if re.fullmatch(known, name):
                    self._refuse(rule, f"'{name}=' is not followed", start, hint)
            self._refuse("CC135", f"'{name}=' is not followed", start)
        value, mode, end = self._value(equals + 1)
        self.at = end
        if not letter:
            return
        mode = name if name in ("TURN", "FP") else MACHINE_AXIS if name in ("X1", "Y1", "Z1") else mode
        if value[0] == "number":
            self.words.append(Word(letter, float(value[1]), start, end, mode))
            return
        self.expressions.append((len(self.words), value))
        self.words.append(Word(letter, 0.0, start, end, mode))

    def _blanks(self, at: int) -> int:
        count = 0
        while at + count < self.end and self.line[at + count] in " \t":
            count += 1
        return count

    def _value(self, at: int) -> tuple[Expression, str, int]:
        """Expression behind `=`, its mode (AC absolute, IC relative), and its end."""
        at += self._blanks(at)
        mode = self.line[at : at + 2].upper()
        parser = Parser(self.line[: self.end], at, SINUMERIK)
        try:
            if mode in ("AC", "IC") and self._next(at + 2) == "(":
                parser.at = at + 2
                value = parser.group()
            else:
                mode = ""
                value = parser.expression(0)
        except ExpressionError as error:
            refuse(self.text, self.row, error.column, "CC123", error.message)
        if value[0] == "negative" and value[1][0] == "number":
            value = ("number", -value[1][1], value[2])
        return value, mode, parser.behind()

    def _reset(self, start: int, end: int, name: str) -> None:
        self.at = end
        rest = self.line[end : self.end].strip(BLANK)
        if rest in ("", "()"):
            self.at = self.end
            return
        self._refuse_statement(name, start)

    def _skip_group(self) -> None:
        """Skip the brackets behind a statement."""
        at = self.at + self._blanks(self.at)
        if self.line[at : at + 1] != "(":
            return
        depth, quoted = 0, False
        for k in range(at, self.end):
            char = self.line[k]
            quoted = quoted != (char == '"')
            if not quoted:
                depth += (char == "(") - (char == ")")
            if depth == 0:
                self.at = k + 1
                return
        self._refuse("CC123", "')' is missing", at)


def read_siemens_line(text: Text, row: int) -> Line:
    """Words of line `row` of a Sinumerik program."""
    return SiemensLine(text, row).read()
