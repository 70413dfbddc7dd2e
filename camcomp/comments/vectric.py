"""Vectric (VCarve, Aspire): tools in words, `(T1 : End Mill {6 mm})`; `( Material Size)` without the place of the zero."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

from camcomp.gcode.stated import INCH_MM, Comment, OpenStatement, StatedTool, Statement, cutter, numbers

TITLE = "Vectric (End Mill {6 mm})"
MARKS = (b"END MILL", b"BALL NOSE", b"MATERIAL SIZE")
_TOOL = re.compile(
    r"(?:T\s*(?P<number>\d+)\s*[:=-]?\s*)?.*?\b(?P<kind>end mill|ball nose)\s*[({\[]\s*(?P<size>[\d.]+)(?:/(?P<part>\d+))?\s*(?P<unit>mm|inch|in|\")",
    re.IGNORECASE,
)


def read(comments: Sequence[Comment]) -> Iterator[Statement]:
    """Tools; the block is a doubt."""
    for comment in comments:
        if comment.text.upper().startswith("MATERIAL SIZE"):
            yield OpenStatement(comment, "the place of the block is not stated")
        elif found := _TOOL.match(comment.text):
            sized = replace(comment, unit_mm=1.0 if found["unit"].lower() == "mm" else INCH_MM)
            size, part = numbers(comment, [found["size"], found["part"] or "1"], "tool")
            diameter = size / max(part, 1.0)
            form = "ball" if found["kind"].lower() == "ball nose" else "flat"
            number = int(found["number"]) if found["number"] else comment.next_tool
            if number is not None:
                yield StatedTool(comment, number, cutter(sized, form, diameter))
