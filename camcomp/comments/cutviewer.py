"""CutViewer: `(STOCK/BLOCK,dx,dy,dz,ox,oy,oz)`, `(TOOL/MILL,diameter,corner radius,height,taper angle)`, `(TOOL/DRILL,...)`.

ox, oy, oz lead from the lower left bottom corner of the block to the program's zero. Posts that write
`(stockMin:...)` and `(stockMax:...)` next to it (Carbide Create and its kin) are held against these.
"""

import re
from collections.abc import Iterator, Sequence
from functools import partial

from camcomp.gcode.stated import (
    Comment,
    OpenStatement,
    StatedError,
    StatedStock,
    StatedTool,
    Statement,
    box,
    cutter,
    form_of,
    numbers,
    read_each,
)

TITLE = "CutViewer (STOCK/..., TOOL/...)"
MARKS = (b"STOCK/", b"TOOL/", b"STOCKMIN:", b"STOCKMAX:")
_CORNER = re.compile(r"STOCKM(IN|AX)\s*:\s*(.*)", re.IGNORECASE)
SAME_MM = 0.02  # corners are written with two decimals


def read(comments: Sequence[Comment]) -> Iterator[Statement]:
    """Blocks, tools in the order in which they come into use, and what contradicts itself."""
    return read_each(comments, partial(_statement, {}))


def _statement(corners: dict[str, list[float]], comment: Comment) -> Statement | None:
    """The statement of a comment; corners that it states are kept for the block, empty where they cannot be read."""
    if found := _CORNER.match(comment.text):
        words = [each.strip().lower().removesuffix("mm").removesuffix("in") for each in found[2].split(",")]
        corners[found[1].upper()] = []
        corners[found[1].upper()] = numbers(comment, words, f"stockM{found[1].lower()}")
        return None
    head, *words = (each.strip() for each in comment.text.split(","))
    kind = head.upper()
    if kind == "STOCK/BLOCK":
        return _block(comment, words, corners)
    if kind in ("TOOL/MILL", "TOOL/DRILL"):
        return _tool(comment, kind, words)
    return OpenStatement(comment, f"{head} cannot be followed") if kind.startswith(("STOCK/", "TOOL/")) else None


def _block(comment: Comment, words: Sequence[str], corners: dict[str, list[float]]) -> Statement:
    values = numbers(comment, words, "STOCK/BLOCK")
    if len(values) == 3:
        return OpenStatement(comment, "the place of the block is not stated")
    if len(values) != 6:
        raise StatedError(comment, f"STOCK/BLOCK has 6 numbers, not {len(values)}")
    size, origin = values[:3], values[3:]
    low = [-each for each in origin]
    high = [a + b for a, b in zip(low, size, strict=True)]
    if corners:
        stated = [*corners.get("IN", ()), *corners.get("AX", ())]
        if len(stated) != 6 or any(abs(a - b) > SAME_MM for a, b in zip(stated, [*low, *high], strict=True)):
            return OpenStatement(comment, "stockMin and stockMax state another block")
    elif any(not 0.0 <= o <= s for o, s in zip(origin, size, strict=True)):
        return OpenStatement(
            comment, "the program's zero lies outside of the block, or the corner is meant instead of it"
        )
    stock: StatedStock = box(comment, low, high)
    return stock


def _tool(comment: Comment, kind: str, words: Sequence[str]) -> Statement:
    if comment.next_tool is None:
        return OpenStatement(comment, "no T word follows")
    values = numbers(comment, words, kind)
    if not values:
        raise StatedError(comment, f"{kind} has no diameter")
    diameter, second, third, taper, *_ = [*values, 0.0, 0.0, 0.0, 0.0]
    if kind == "TOOL/DRILL":
        keys = cutter(comment, "drill", diameter)
        if 0.0 < second < 180.0:
            keys["point_deg"] = second
        return StatedTool(comment, comment.next_tool, keys)
    if taper != 0.0:
        return OpenStatement(comment, f"T{comment.next_tool}: a tapered mill cannot be followed")
    return StatedTool(comment, comment.next_tool, cutter(comment, form_of(diameter, second), diameter, second, third))
