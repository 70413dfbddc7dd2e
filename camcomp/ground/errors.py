"""Errors for the user: each has a rule id, a location in a file, a hint, and the exit code of its family.

Several errors of one file are raised together: the first one carries the `others`.
"""

import re
from collections.abc import Sequence
from typing import ClassVar

from camcomp.ground.records import dataclass
from camcomp.ground.rules import RULES


@dataclass(frozen=True)
class Location:
    """A location in a text file; `line` and `column` count from 1, `source` is the text of that line."""

    file: str
    line: int
    column: int
    source: str = ""


class CamcompError(Exception):
    """Base of every error of the input, as opposed to bugs of camcomp. Only its subclasses are raised."""

    exit_code: ClassVar[int]

    def __init__(
        self,
        rule: str,
        message: str,
        *,
        at: Location | None = None,
        hint: str | None = None,
        others: Sequence["CamcompError"] = (),
    ) -> None:
        super().__init__(message)
        self.rule = rule
        self.message = message
        self.at = at
        self.hint = hint or RULES[rule].hint or f"`camcomp explain {rule}` says more"
        self.others = tuple(others)

    def all(self) -> tuple["CamcompError", ...]:
        """This error and those found with it, in the order in which they were found."""
        return (self, *(each for other in self.others for each in other.all()))


class Terminated(BaseException):
    """A signal asks the process to end; raised so that open files are closed and no output is half-written."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


class PluginWarning(UserWarning):
    """A plug-in of the user cannot be used and is missing in a list; a run that names it raises an error instead."""


class CheckFailed(CamcompError):
    """The work is finished, and a check failed (residual, limit, already compensated)."""

    exit_code = 1


class ConfigError(CamcompError):
    """Usage, YAML or experiment file."""

    exit_code = 2


class ProgramError(CamcompError):
    """Unreadable or unsupported NC program."""

    exit_code = 3


class PhysicsError(CamcompError):
    """The model has no solution: no convergence, out of reach, singular or unstable."""

    exit_code = 4


class FileError(CamcompError):
    """A file cannot be read or written."""

    exit_code = 5


def raise_all(errors: Sequence[CamcompError]) -> None:
    """Raise the first of `errors` with the others attached, if there are any."""
    if errors:
        first, *rest = errors
        first.others = (*first.others, *rest)
        raise first


# Characters that move a terminal's cursor, change the order of letters, or represent invalid UTF-8 bytes of a name.
_UNSHOWN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


def shown(text: str) -> str:
    """A text for terminals and reports: control characters and lone surrogates as escapes."""
    return _UNSHOWN.sub(lambda found: _escaped(ord(found[0])), text)


def _escaped(code: int) -> str:
    if 0xDC80 <= code <= 0xDCFF:  # a byte of a file name
        code -= 0xDC00
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}"


_RED, _BOLD, _CYAN, _OFF = "\033[31;1m", "\033[1m", "\033[36m", "\033[0m"


def format_error(error: CamcompError, color: bool = False) -> str:
    """Text for a person: one block per error, `file:line:col: error[id]: text`, the line with a caret, the hint."""
    red, bold, cyan, off = (_RED, _BOLD, _CYAN, _OFF) if color else ("", "", "", "")
    blocks = []
    for each in error.all():
        at = each.at
        place = shown(f"{at.file}:{at.line}:{at.column}") if at else "camcomp"
        block = [f"{bold}{place}:{off} {red}error[{each.rule}]{off}: {shown(each.message)}"]
        if at and at.source.strip():
            source = at.source.rstrip("\r\n")
            # Tabs stay tabs under the line, so that the caret is below its character.
            padding = "".join(c if c == "\t" else " " for c in source[: at.column - 1])
            padding += " " * (len(shown(source[: at.column - 1])) - len(padding))
            block += [f"  {shown(source)}", f"  {padding}{red}^{off}"]
        if each.hint:
            block.append(f"  {cyan}hint:{off} {shown(each.hint)}")
        blocks.append("\n".join(block))
    return "\n".join(blocks)
