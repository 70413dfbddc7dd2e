"""Fusion: `(@F360|STOCK|...)` of the Makera post, and `(T1 D=6. CR=0. - ZMIN=-5. - flat end mill)` of nearly all posts."""

import re
from collections.abc import Iterator, Sequence

from camcomp.comments._pipes import read_pipes
from camcomp.gcode.stated import Comment, OpenStatement, StatedTool, Statement, cutter, form_of, numbers

TITLE = "Fusion (@F360|..., T1 D=...)"
MARKS = (b"@F360|", b" D=")
_TOOL = re.compile(r"T\s*(\d+)\s.*?\bD=\s*([\d.]+)(?:\s+CR=\s*([\d.]+))?.*?-\s*([A-Za-z ]+)$", re.IGNORECASE)


def read(comments: Sequence[Comment]) -> Iterator[Statement]:
    """Tools and stock."""
    yield from read_pipes(comments, "F360")
    for comment in comments:
        if found := _TOOL.match(comment.text):
            yield _tool(comment, found)


def _tool(comment: Comment, found: re.Match[str]) -> Statement:
    number, kind = int(found[1]), found[4].strip().lower()
    diameter, corner = numbers(comment, [found[2], found[3] or "0"], f"T{number}")
    if kind in ("spot drill", "center drill", "drill"):
        return StatedTool(comment, number, cutter(comment, "drill", diameter))
    if not kind.startswith(("flat", "bull nose", "ball", "face mill")):
        return OpenStatement(comment, f"T{number}: a tool of the type '{kind}' cannot be followed")
    form = "ball" if kind.startswith("ball") else form_of(diameter, corner)
    return StatedTool(comment, number, cutter(comment, form, diameter, corner))
