"""One line of a program as words; ambiguous text is refused."""

import re
from collections.abc import Iterable
from typing import NamedTuple, NoReturn

from camcomp.gcode.expressions import Expression, ExpressionError, Parser
from camcomp.gcode.spelling import Spelling
from camcomp.gcode.text import Text
from camcomp.ground.errors import ProgramError

BLANK = " \t\0\x1a\x0b\x0c"
_WORD = re.compile(r"([A-Za-z])[ \t]*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))")
_COLON = re.compile(r":[ \t]*([0-9]+)(?![0-9.])")
_FEED = re.compile(r"(?<![A-Za-z_])[Ff][ \t]*=?[ \t]*[+]?([0-9]+\.?[0-9]*|\.[0-9]+)")
_LOOSE = re.compile(r"[A-Za-z]?[ \t]*[+-]?[0-9.,]+(?:[ \t]+[0-9.,]+)*")


class Word(NamedTuple):
    """A letter and its number; `begin` and `end` bound both in the line."""

    letter: str
    value: float
    begin: int
    end: int
    mode: str = ""  # AC or IC: absolute or relative, with precedence over G90, G91; TURN: full circles beyond the arc


class Setting(NamedTuple):
    """`#1 = ...`: parameter, value, and position in the line."""

    target: Expression
    value: Expression
    begin: int
    end: int


class Line(NamedTuple):
    """Content of one line. Words whose value is an expression have 0 until the line is executed."""

    words: list[Word]
    deleted: bool = False  # starts with a block delete character
    warning: str = ""
    expressions: tuple[tuple[int, Expression], ...] = ()  # index of the word, its value
    settings: tuple[Setting, ...] = ()


def refuse(text: Text, row: int, column: int, rule: str, message: str, hint: str | None = None) -> NoReturn:
    """Raise a ProgramError that points at a character of a line."""
    raise ProgramError(rule, message, at=text.place(row, column), hint=hint)


def comment_end(line: str, start: int) -> tuple[int, bool]:
    """Index behind the comment that opens at `start`, and whether it is closed.

    Comments nest if that closes them: without nesting the same text would end with a stray `)`, which all controllers
    refuse, so that the reading is unique.
    """
    depth = 0
    for k in range(start, len(line)):
        if line[k] == "(":
            depth += 1
        elif line[k] == ")":
            depth -= 1
            if depth == 0:
                return k + 1, True
    close = line.find(")", start)
    return (close + 1, True) if close >= 0 else (len(line), False)


def code_of(line: str, brackets: bool = True) -> str:
    """The line with its comments blanked, same length; `brackets`: `(...)` is a comment."""
    pieces, k = [], 0
    while k < len(line):
        if line[k] == ";":
            break
        if line[k] == "(" and brackets:
            end, _ = comment_end(line, k)
            pieces.append(" " * (end - k))
            k = end
        else:
            pieces.append(line[k])
            k += 1
    return "".join(pieces).ljust(len(line))


def points_in_feeds(lines: Iterable[str]) -> bool:
    """Whether the first feed of a program, a plain number, has a decimal point."""
    for line in lines:
        if ("F" in line or "f" in line) and (found := _FEED.search(code_of(line))):
            return "." in found[1]
    return False


def read_line(text: Text, row: int, spelling: Spelling | None = None, start: int = 0) -> Line:
    """Words of line `row` in their order, from character `start`.

    Raises ProgramError with the location of unreadable text.
    """
    line = text.line(row)
    words: list[Word] = []
    expressions: list[tuple[int, Expression]] = []
    settings: list[Setting] = []
    deleted = False
    warning = ""
    k, n = start, len(line)
    match = _WORD.match
    while k < n:
        char = line[k]
        if char in BLANK:
            k += 1
            continue
        found = match(line, k)
        if found is not None:
            end = found.end()
            rest = line[end:].lstrip(" \t")[:1]
            if rest and (rest in ".,0123456789" or (rest in "+-" and line[end] == rest)):
                _malformed(text, row, k, end)
            words.append(Word(found[1].upper(), float(found[2]), k, end))
            k = end
        elif char == ";":
            break
        elif char == ":" and not words and (found := _COLON.match(line, k)):
            words.append(Word("O", float(found[1]), k, found.end()))  # the program number of ISO tapes
            k = found.end()
        elif char == "(":
            k, closed = comment_end(line, k)
            if not closed:
                warning = "comment is not closed; the rest of the line counts as comment"
        elif char == "/" and all(each.letter == "N" for each in words) and not settings:
            deleted = True
            k += 1
            while k < n and line[k].isdigit() and not words:
                k += 1
        elif char == "%":
            if line.strip(BLANK).startswith("%"):
                break
            refuse(text, row, k, "CC107", "'%' stands inside a line")
        elif spelling is not None and char == "#":
            setting = _setting(text, row, k, spelling)
            settings.append(setting)
            k = setting.end
        elif spelling is not None and char.isascii() and char.isalpha():
            word, value = _computed(text, row, k, spelling)
            expressions.append((len(words), value))
            words.append(word)
            k = word.end
        else:
            _unreadable(text, row, k)
    return Line(words, deleted, warning, tuple(expressions), tuple(settings))


def _setting(text: Text, row: int, column: int, spelling: Spelling) -> Setting:
    parser = Parser(text.line(row), column, spelling)
    try:
        target = parser.parameter()
        if parser.blank() != "=":
            parser.fail("'=' is missing")
        parser.at += 1
        value = parser.value() if spelling.named else parser.expression(0)
    except ExpressionError as error:
        refuse(text, row, error.column, "CC123", error.message)
    return Setting(target, value, column, parser.behind())


def _computed(text: Text, row: int, column: int, spelling: Spelling) -> tuple[Word, Expression]:
    line = text.line(row)
    parser = Parser(line, column + 1, spelling)
    if parser.blank() not in ("#", "[", "+", "-") and not _function_follows(line, parser.at, spelling):
        _unreadable(text, row, column)
    try:
        value = parser.value()
    except ExpressionError as error:
        refuse(text, row, error.column, "CC123", error.message)
    return Word(line[column].upper(), 0.0, column, parser.behind()), value


def _function_follows(line: str, at: int, spelling: Spelling) -> bool:
    end = at
    while end < len(line) and line[end].isalpha():
        end += 1
    name = line[at:end].upper()
    opens = line[end:].lstrip(" \t")[:1] == spelling.opening
    return opens and (name in spelling.functions or name == "EXISTS")


def _malformed(text: Text, row: int, column: int, end: int) -> NoReturn:
    line = text.line(row)
    if line[end:].lstrip(" \t")[:1] == ",":
        after = line[end:].lstrip(" \t")[1:2].upper()
        if not after.isdigit():
            what = "rounds or chamfers a corner" if after in ("R", "C", "A") else "has no meaning here"
            refuse(text, row, end, "CC139", f"',{after}' {what}")
    found = _LOOSE.match(line, column)
    piece = found[0] if found else ""
    if "," in piece:
        refuse(text, row, column, "CC101", f"'{piece}' has a decimal comma")
    refuse(text, row, column, "CC102", f"'{piece}' is not one number")


def _unreadable(text: Text, row: int, column: int) -> NoReturn:
    line = text.line(row)
    char = line[column]
    if char in "#[":
        refuse(text, row, column, "CC123", "this dialect has no parameters and expressions")
    if char.isascii() and char.isalpha():
        rest = line[column + 1 :].lstrip(BLANK)
        if rest[:1] in ("#", "["):
            refuse(text, row, column, "CC123", "this dialect has no parameters and expressions")
        if rest[:1] == ",":
            refuse(text, row, column, "CC101", f"'{char},' has a decimal comma")
        word = re.match(r"[A-Za-z_]+", line[column:])
        if word is not None and (len(word[0]) > 1 or rest[:1] == "="):
            refuse(text, row, column, "CC135", f"'{word[0]}' is no statement that camcomp knows")
        refuse(text, row, column, "CC103", f"'{char}' has no number")
    if char.isdigit() or char in ".+-":
        refuse(text, row, column, "CC103", "number without a letter")
    if char in "@^":
        refuse(text, row, column, "CC116", f"'{char}' is a polar coordinate")
    if char == ",":
        refuse(text, row, column, "CC139", "a comma stands for a rounded corner, a chamfer, or a decimal comma")
    refuse(text, row, column, "CC107", f"'{text.readable(char)}' has no meaning here")
