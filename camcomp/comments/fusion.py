"""Fusion: `(@F360|STOCK|...)` of the Makera post, and `(T1 D=6. CR=0. - ZMIN=-5. - flat end mill)` of nearly all posts."""

import re
from collections.abc import Iterator, Sequence

from camcomp.comments._pipes import read_pipes
from camcomp.gcode.stated import Comment, OpenStatement, StatedTool, Statement, cutter, form_of, numbers

TITLE = "Fusion (@F360|..., T1 D=...)"
MARKS = (b"@F360|", b" D=")
_TOOL = re.compile(
    r"T\s*(\d+)\s.*?\bD=\s*(\S+)(?:\s+CR=\s*(\S+))?(?:\s+TAPER=\s*([\d.]+)\s*deg)?.*?-\s*([A-Za-z ]+)$", re.IGNORECASE
)


def read(comments: Sequence[Comment]) -> Iterator[Statement]:
    """Tools and stock."""
    yield from read_pipes(comments, "F360")
    for comment in comments:
        if found := _TOOL.match(comment.text):
            yield _tool(comment, found)


def _tool(comment: Comment, found: re.Match[str]) -> Statement:
    number, kind = int(found[1]), found[5].strip().lower()
    diameter, corner = numbers(comment, [found[2], found[3] or "0"], f"T{number}")
    if kind in ("spot drill", "center drill", "drill"):
        keys = cutter(comment, "drill", diameter)
        if found[4] and 0.0 < (point := numbers(comment, [found[4]], f"T{number}")[0]) < 180.0:
            keys["point_deg"] = point
        return StatedTool(comment, number, keys)
    if not kind.startswith(("flat", "bull nose", "bullnose", "ball", "face mill")):
        return OpenStatement(comment, f"T{number}: a tool of the type '{kind}' cannot be followed")
    form = "ball" if kind.startswith("ball") else form_of(diameter, corner)
    return StatedTool(comment, number, cutter(comment, form, diameter, corner))
