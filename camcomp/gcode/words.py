"""One line of a program as words, strictly: what a control might read in two ways is refused, never guessed."""

import re
from typing import NamedTuple, NoReturn

from camcomp.diagnostics import ProgramError
from camcomp.gcode.text import Text

BLANK = " \t\0\x1a\x0b\x0c"
_WORD = re.compile(r"([A-Za-z])[ \t]*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))")
_LOOSE = re.compile(r"[A-Za-z]?[ \t]*[+-]?[0-9.,]+(?:[ \t]+[0-9.,]+)*")


class Word(NamedTuple):
    """A letter and its number; `begin` and `end` bound both in the line."""

    letter: str
    value: float
    begin: int
    end: int


class Block(NamedTuple):
    """What one line says."""

    words: list[Word]
    deleted: bool  # starts with a block delete character
    warning: str


def refuse(text: Text, index: int, column: int, rule: str, message: str, hint: str | None = None) -> NoReturn:
    """Raise a ProgramError that points at a character of a line."""
    raise ProgramError(rule, message, at=text.place(index, column), hint=hint)


def comment_end(line: str, start: int) -> tuple[int, bool]:
    """Index behind the comment that opens at `start`, and whether it is closed.

    Comments nest where that closes them: read without nesting, the same text would leave a stray `)` behind, which no
    control accepts, so there is only one reading.
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


def read_line(text: Text, index: int) -> Block:
    """Words of line `index` in their order. Raises ProgramError with the place of what cannot be read."""
    line = text.line(index)
    words: list[Word] = []
    deleted = False
    warning = ""
    k, n = 0, len(line)
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
                _malformed(text, index, k)
            words.append(Word(found[1].upper(), float(found[2]), k, end))
            k = end
        elif char == ";":
            break
        elif char == "(":
            k, closed = comment_end(line, k)
            if not closed:
                warning = "comment is not closed; the rest of the line counts as comment"
        elif char == "/" and all(each.letter == "N" for each in words):
            deleted = True
            k += 1
            while k < n and line[k].isdigit() and not words:
                k += 1
        elif char == "%":
            if line.strip(BLANK).startswith("%"):
                break
            refuse(text, index, k, "CC107", "'%' stands inside a line")
        else:
            _unreadable(text, index, k)
    return Block(words, deleted, warning)


def _malformed(text: Text, index: int, column: int) -> NoReturn:
    found = _LOOSE.match(text.line(index), column)
    piece = found[0] if found else ""
    if "," in piece:
        refuse(text, index, column, "CC101", f"'{piece}' has a decimal comma")
    refuse(text, index, column, "CC102", f"'{piece}' is not one number")


def _unreadable(text: Text, index: int, column: int) -> NoReturn:
    char = text.line(index)[column]
    if char in "#[":
        refuse(text, index, column, "CC123", "parameters and expressions are not read here")
    if char.isascii() and char.isalpha():
        rest = text.line(index)[column + 1 :].lstrip(BLANK)
        if rest[:1] in ("#", "["):
            refuse(text, index, column, "CC123", "parameters and expressions are not read here")
        if rest[:1] == ",":
            refuse(text, index, column, "CC101", f"'{char},' has a decimal comma")
        refuse(text, index, column, "CC103", f"'{char}' has no number")
    if char.isdigit() or char in ".+-":
        refuse(text, index, column, "CC103", "number without a letter")
    refuse(text, index, column, "CC107", f"'{text.readable(char)}' has no meaning here")
