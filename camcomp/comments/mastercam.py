"""Mastercam: `(T1|1/4 FLAT ENDMILL|H1|D1|TOOL DIA. - .25)`, `(1/4 FLAT ENDMILL TOOL - 1 DIA. OFF. - 1 LEN. - 1 DIA. - .25)`.

The form is that of the description, which its users may change: flat, ball and drill where it says so, else it is open.
"""

import re
from collections.abc import Iterator, Sequence

from camcomp.gcode.stated import (
    Comment,
    OpenStatement,
    StatedMaterial,
    StatedTool,
    Statement,
    cutter,
    numbers,
    read_each,
)

TITLE = "Mastercam (T1|...|TOOL DIA. - 6.)"
MARKS = (b"DIA. -", b"MATERIAL -")
_TABLE = re.compile(r"T\s*(\d+)\s*\|(.*?)\|.*\bDIA\. - *(\S+)", re.IGNORECASE)
_LINE = re.compile(
    r"(.*?)\bTOOL - *(\d+)\b(.*?)DIA\. OFF\. - *\d+ +LEN\. - *\d+ +(?:TOOL )?DIA\. - *(\S+)$", re.IGNORECASE
)
_FORMS = (
    (r"\bFLAT END ?MILL\b", "flat"),
    (r"\bBALL (?:NOSE )?END ?MILL\b", "ball"),
    (r"^(?!.*\b(?:SPOT|CENTER|CENTRE|COUNTER|STEP))(?=.*\bDRILL\b)", "drill"),
)


def read(comments: Sequence[Comment]) -> Iterator[Statement]:
    """Tools and the material."""
    return read_each(comments, _statement)


def _statement(comment: Comment) -> Statement | None:
    text = comment.text
    if text.upper().startswith("MATERIAL -"):
        return StatedMaterial(comment, text.partition("-")[2].strip())
    if table := _TABLE.match(text):
        number, words, size = table[1], table[2], table[3]
    elif line := _LINE.match(text):
        number, words, size = line[2], f"{line[1]} {line[3]}", line[4]
    else:
        return None
    form = next((form for shape, form in _FORMS if re.search(shape, words, re.IGNORECASE)), None)
    if form is None:
        return OpenStatement(comment, f"T{int(number)}: the form of '{words.strip()}' is open")
    return StatedTool(comment, int(number), cutter(comment, form, numbers(comment, [size], f"T{int(number)}")[0]))
