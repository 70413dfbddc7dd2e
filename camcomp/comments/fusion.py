"""Fusion: `(@F360|STOCK|...)` of the Makera post, and `(T1 D=6. CR=0. - ZMIN=-5. - flat end mill)` of nearly all posts."""

import re
from collections.abc import Iterator, Sequence

from camcomp.comments._pipes import read_pipes
from camcomp.gcode.stated import (
    Comment,
    OpenStatement,
    StatedError,
    StatedTool,
    Statement,
    cutter,
    form_of,
    numbers,
    read_each,
)

TITLE = "Fusion (@F360|..., T1 D=...)"
MARKS = (b"@F360|", b" D=")
_TOOL = re.compile(r"T\s*(\d+)\s.*?\bD=\s*(\S+)(?:\s+CR=\s*(\S+))?(?:\s+TAPER=\s*([\d.]+)\s*deg)?(.*)$", re.IGNORECASE)
_KIND = re.compile(r"- *([A-Z][A-Z ]*?) *(?:- *L=.*)?$", re.IGNORECASE)
_MILLS = ("flat", "bull nose", "bullnose", "ball", "face mill")


def read(comments: Sequence[Comment]) -> Iterator[Statement]:
    """Tools and stock."""
    yield from read_pipes(comments, "F360")
    yield from read_each(comments, _tool)


def _tool(comment: Comment) -> Statement | None:
    if not (found := _TOOL.match(comment.text)):
        return None
    number, named = int(found[1]), _KIND.search(found[5])
    if named is None:
        return OpenStatement(comment, f"T{number}: the type of the tool is not stated")
    kind = named[1].lower()
    diameter, corner = numbers(comment, [found[2], found[3] or "0"], f"T{number}")
    if kind in ("spot drill", "center drill", "drill"):
        keys = cutter(comment, "drill", diameter)
        if found[4] and 0.0 < (point := numbers(comment, [found[4]], f"T{number}")[0]) < 180.0:
            keys["point_deg"] = point
        return StatedTool(comment, number, keys)
    if not kind.startswith(_MILLS):
        return OpenStatement(comment, f"T{number}: a tool of the type '{kind}' cannot be followed")
    form = form_of(diameter, corner)
    if (kind.startswith("flat") and form != "flat") or (kind.startswith("ball") and corner and form != "ball"):
        raise StatedError(comment, f"T{number}: a corner radius of {corner:g} is not that of a {kind}")
    return StatedTool(comment, number, cutter(comment, "ball" if kind.startswith("ball") else form, diameter, corner))
