"""Detection of a program's dialect: named by the user, or found by the marks in the record of each dialect."""

import re
from typing import Any

from camcomp.gcode.dialect import Dialect
from camcomp.gcode.text import END_OF_LINE, Text
from camcomp.ground.errors import ProgramError
from camcomp.ground.shelf import load, usable

_LOOKED_AT = 200_000  # characters
_PLAINTEXT = re.compile(
    r"^[ \t]*+\d*[ \t]*+(BEGIN[ \t]++PGM|TOOL[ \t]++(CALL|DEF)|L[ \t]++[XYZ][ \t]*+[+-]|CC[ \t]++X|BLK[ \t]++FORM)",
    re.MULTILINE | re.IGNORECASE,
)
_PLAIN_LINES = re.compile(
    r"^(?:[ \t]*+(?:[NXYZF][ \t]*+[-+.\d]++|G[ \t]*+0?[01](?![\d.])))++[ \t]*+\n", re.MULTILINE | re.IGNORECASE
)
DEFAULT = "rs274"
_ENOUGH = 4  # weight of marks below which the default applies


def dialect_of(text: Text, name: str | None = None) -> Dialect:
    """Record of the dialect called `name`, else of the one with the most marks in the text, else of RS274.

    Raises ProgramError CC127 for Heidenhain conversational programs, ConfigError CC213 for an unknown name.
    """
    if name is not None:
        return _record(name)
    sample = text.string[:_LOOKED_AT]
    if "\r" in sample:
        sample = re.sub(END_OF_LINE, "\n", sample)
    if len(_PLAINTEXT.findall(sample)) >= 2:
        found = _PLAINTEXT.search(sample)
        row = sample.count("\n", 0, found.start(1)) if found else 0
        raise ProgramError(
            "CC127", "this is a Heidenhain conversational program", at=text.place(min(row, len(text) - 1))
        )
    sample = _PLAIN_LINES.sub("", sample)  # most of a program, in all dialects, so without marks
    best, most = _record(DEFAULT), _ENOUGH - 1
    for _, member in usable("dialects"):
        record = _of(member)
        if text.name.lower().endswith(record.endings):
            return record
        weight = record.weight(sample)
        if weight > most:
            best, most = record, weight
    return best


def endings() -> frozenset[str]:
    """Endings of file names that belong to one dialect."""
    return frozenset(each for _, member in usable("dialects") for each in _of(member).endings)


def _record(name: str) -> Dialect:
    return _of(load("dialects", name))


def _of(member: Any) -> Dialect:
    """Record of a plug-in: a module with the record, or, from an entry point, the record itself."""
    record: Dialect = getattr(member, "DIALECT", member)
    return record
