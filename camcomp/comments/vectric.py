"""Vectric (VCarve, Aspire): tools in words, `(T1 : End Mill {6 mm})`; `( Material Size)` without the place of the zero."""

import re
from collections.abc import Iterator, Sequence

from camcomp.gcode.stated import INCH_MM, Comment, OpenStatement, StatedTool, Statement, cutter, numbers, read_each
from camcomp.ground.records import replace

TITLE = "Vectric (End Mill {6 mm})"
MARKS = (b"END MILL", b"BALL NOSE", b"MATERIAL SIZE")
_TOOL = re.compile(
    r"(?:T?\s*(?P<number>\d+)\s*[:=-]\s*|T\s*(?P<named>\d+)\s+)?(?P<words>.*?)\b(?P<kind>end mill|ball nose)"
    r"\s*[({\[]\s*(?P<size>[\d.]+)(?:/(?P<part>\d+))?\s*(?P<unit>mm|inch|in|\")",
    re.IGNORECASE,
)
_OTHER = re.compile(r"taper|radius|form|engrav", re.IGNORECASE)


def read(comments: Sequence[Comment]) -> Iterator[Statement]:
    """Tools; the block is a doubt."""
    return read_each(comments, _statement)


def _statement(comment: Comment) -> Statement | None:
    if comment.text.upper().startswith("MATERIAL SIZE"):
        return OpenStatement(comment, "the place of the block is not stated")
    if not (found := _TOOL.match(comment.text)):
        return None
    if other := _OTHER.search(found["words"]):
        return OpenStatement(comment, f"a tool of the type '{other[0].lower()} {found['kind']}' cannot be followed")
    number = found["number"] or found["named"]
    tool = comment.near_tool if number is None else int(number)
    if tool is None:
        return OpenStatement(comment, "no T word is near, so the number of the tool is open")
    sized = replace(comment, unit_mm=1.0 if found["unit"].lower() == "mm" else INCH_MM)
    size, part = numbers(comment, [found["size"], found["part"] or "1"], "tool")
    form = "ball" if found["kind"].lower() == "ball nose" else "flat"
    return StatedTool(comment, tool, cutter(sized, form, size / max(part, 1.0)))
