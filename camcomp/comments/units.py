"""The unit of length in words, `(Units: 'in' and 'in/min')`, `(machine units: mm/min)`, `(ALL DIMENSIONS ARE IN INCHES)`.

Some posts write no G20 and leave the unit to the controller; this comment is then the only place where it stands.
"""

import re
from collections.abc import Iterator, Sequence

from camcomp.gcode.stated import INCH_MM, Comment, StatedUnit, Statement, read_each

TITLE = "unit in words"
MARKS = (b"UNIT", b"DIMENSION")
_UNIT = r"(?P<inch>INCH(?:ES)?\b|IMPERIAL\b|IN(?=['\"/,.]|\s*$))|(?P<mm>MM\b|MILLIMET(?:ER|RE)S?\b|METRIC\b)"
_SAID = re.compile(
    rf"\bUNITS?\s*[:=]+\s*['\"]?(?:{_UNIT})|\b(?:UNITS|DIMENSIONS)\s+(?:ARE\s+)?IN\s+(?:{_UNIT.replace('P<', 'P<in_')})",
    re.IGNORECASE,
)


def read(comments: Sequence[Comment]) -> Iterator[Statement]:
    """Units of comments that name one."""
    return read_each(comments, _unit)


def _unit(comment: Comment) -> Statement | None:
    if not (found := _SAID.search(comment.text)):
        return None
    return StatedUnit(comment, INCH_MM if found["inch"] or found["in_inch"] else 1.0)
