"""pcb2gcode: `(MSG, Change tool bit to drill size 0.8mm)`, `(MSG, Change tool bit to cutter diameter 2mm)` next to the T word."""

import re
from collections.abc import Iterator, Sequence

from camcomp.gcode.stated import INCH_MM, Comment, OpenStatement, StatedTool, Statement, cutter, numbers, read_each
from camcomp.ground.records import replace

TITLE = "pcb2gcode (Change tool bit to ...)"
MARKS = (b"CHANGE TOOL BIT TO",)
_TOOL = re.compile(
    r".*\bCHANGE TOOL BIT TO (DRILL SIZE|CUTTER DIAMETER|MILL DIAMETER) *([\d.]+) *(MM|INCH|IN)\b", re.IGNORECASE
)


def read(comments: Sequence[Comment]) -> Iterator[Statement]:
    """Drills and cutters; engraving mills have a tip that is not stated."""
    return read_each(comments, _tool)


def _tool(comment: Comment) -> Statement | None:
    if not (found := _TOOL.match(comment.text)):
        return None
    if comment.near_tool is None:
        return OpenStatement(comment, "no T word is near, so the number of the tool is open")
    kind = found[1].upper()
    if kind.startswith("MILL"):
        return OpenStatement(comment, f"T{comment.near_tool}: the form of the engraving mill is open")
    sized = replace(comment, unit_mm=1.0 if found[3].upper() == "MM" else INCH_MM)
    diameter = numbers(comment, [found[2]], "tool bit")[0]
    return StatedTool(
        comment, comment.near_tool, cutter(sized, "drill" if kind.startswith("DRILL") else "flat", diameter)
    )
