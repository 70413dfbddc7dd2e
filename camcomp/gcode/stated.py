"""Stock, tools and material in the comments that CAM systems write into programs.

`camcomp/comments` has one reader per notation. It gets the comments with its mark and returns their statements. Lengths are
in the unit of the comment, `Comment.unit_mm` mm each.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, BinaryIO

from camcomp.ground import shelf

CHUNK = 1 << 22  # bytes read at once
INCH_MM = 25.4
_UNIT_CODES = {b"20": INCH_MM, b"70": INCH_MM, b"700": INCH_MM, b"21": 1.0, b"71": 1.0, b"710": 1.0}
_COMMENT = re.compile(rb"\([^)\r\n]*\)|;[^\r\n]*")
_INSIDE = re.compile(rb"[A-Z#]")  # a letter behind one of these begins no word
_UNIT = re.compile(rb"G0*(20|21|700?|710?)(?![0-9.])")
_TOOL = re.compile(rb"T[ \t]*([0-9]{1,8})")
_OFFSET = re.compile(rb"G(5[4-9](?:\.[123])?)(?![0-9])")


@dataclass(frozen=True)
class Comment:
    """A comment without its brackets. line, column: from 1; unit_mm: mm per unit of length in force there.

    next_tool: the next T word after it, or None.
    """

    line: int
    column: int
    text: str
    unit_mm: float
    next_tool: int | None = None


@dataclass(frozen=True)
class StatedStock:
    """A stock as keys of `workpiece: stock` (mm, program frame), without resolution."""

    comment: Comment
    keys: dict[str, Any]
    reader: str = ""  # its title; set by read_stated, as for all statements


@dataclass(frozen=True)
class StatedTool:
    """A tool as keys of `tools:`, by its T word."""

    comment: Comment
    number: int
    keys: dict[str, Any]
    reader: str = ""


@dataclass(frozen=True)
class StatedMaterial:
    """The material of the workpiece as named in the comment."""

    comment: Comment
    name: str
    reader: str = ""


@dataclass(frozen=True)
class OpenStatement:
    """An ambiguous or incomplete statement in a comment, and the reason."""

    comment: Comment
    why: str
    reader: str = ""


Statement = StatedStock | StatedTool | StatedMaterial | OpenStatement


@dataclass
class Stated:
    """All statements in the comments of a program. offsets: work offsets that the program uses, G54 to G59.3."""

    stocks: list[StatedStock] = field(default_factory=list)
    tools: list[StatedTool] = field(default_factory=list)
    materials: list[StatedMaterial] = field(default_factory=list)
    doubts: list[OpenStatement] = field(default_factory=list)
    offsets: set[str] = field(default_factory=set)

    def add(self, statement: Statement) -> None:
        """Add a reader's statement to its list."""
        match statement:
            case StatedStock():
                self.stocks.append(statement)
            case StatedTool():
                self.tools.append(statement)
            case StatedMaterial():
                self.materials.append(statement)
            case OpenStatement():
                self.doubts.append(statement)


def read_stated(source: BinaryIO) -> Stated:
    """Read the statements in a program's comments. source: seekable, at its start, and reset to it.

    A comment with a reader's mark that the reader cannot parse is a doubt.
    """
    readers = [reader for _, reader in shelf.usable("comments")]
    if not _is_marked(source, [mark for reader in readers for mark in reader.MARKS]):
        return Stated()
    data = source.read()
    source.seek(0)
    out, comments = Stated(), _comments(data, b"|".join(re.escape(mark) for reader in readers for mark in reader.MARKS))
    for reader in readers:
        own = [each for each in comments if any(mark.decode() in each.text.upper() for mark in reader.MARKS)]
        try:
            for statement in reader.read(own):
                out.add(replace(statement, reader=reader.TITLE))
        except StatedError as error:
            out.add(OpenStatement(error.comment, str(error), reader.TITLE))
    out.offsets = {f"G{each.decode()}" for each in set(_OFFSET.findall(data.upper()))}
    return out


class StatedError(ValueError):
    """A comment with a reader's mark that the reader cannot parse."""

    def __init__(self, comment: Comment, message: str) -> None:
        super().__init__(message)
        self.comment = comment


def _is_marked(source: BinaryIO, marks: Sequence[bytes]) -> bool:
    """Whether any mark (capitals) occurs in the source in any case; the source is reset to its start."""
    longest, rest = max(map(len, marks)), b""
    try:
        while block := source.read(CHUNK):
            seen = (rest + block).upper()
            if any(mark in seen for mark in marks):
                return True
            rest = block[-longest:]
        return False
    finally:
        source.seek(0)


def _comments(data: bytes, marks: bytes) -> list[Comment]:
    """Comments with one of the marks (an expression of capitals), with the unit in force there.

    Before the first unit code the unit is that of the program if it has a single one, else mm.
    """
    spans = [each.span() for each in _COMMENT.finditer(data)]
    capitals, marked = data.upper(), re.compile(marks)  # a search in one case is many times faster
    units, tools = _words(_UNIT, capitals, spans), _words(_TOOL, capitals, spans)
    sizes = {_UNIT_CODES[each[1]] for each in units}
    first = sizes.pop() if len(sizes) == 1 else 1.0
    unit_at, tool_at = ([each.start() for each in found] for found in (units, tools))
    out, line, begin = [], 1, 0
    for start, end in spans:
        raw = data[start:end]
        if not marked.search(raw.upper()):
            continue
        line, begin = line + data.count(b"\n", begin, start), start
        column = start - max(data.rfind(b"\n", 0, start), data.rfind(b"\r", 0, start))
        text = (raw[1:-1] if raw.startswith(b"(") else raw[1:]).decode("utf-8", "replace").strip()
        unit, tool = bisect_left(unit_at, start), bisect_left(tool_at, end)
        size = _UNIT_CODES[units[unit - 1][1]] if unit else first
        out.append(Comment(line, column, text, size, int(tools[tool][1]) if tool < len(tools) else None))
    return out


def _words(pattern: re.Pattern[bytes], data: bytes, spans: Sequence[tuple[int, int]]) -> list[re.Match[bytes]]:
    """Matches of a word at the start of a word and outside of the spans (ascending)."""
    starts = [start for start, _ in spans]
    out = []
    for each in pattern.finditer(data):
        at = each.start()
        before = bisect_right(starts, at) - 1
        outside = before < 0 or at >= spans[before][1]
        if outside and not (at and _INSIDE.match(data, at - 1)):
            out.append(each)
    return out


def numbers(comment: Comment, words: Sequence[str], what: str) -> list[float]:
    """Words as finite numbers, units of the comment. Raises StatedError, which names `what`."""
    out = []
    for word in words:
        try:
            value = float(word)
        except ValueError:
            raise StatedError(comment, f"{what}: '{word}' is no number") from None
        if not abs(value) < 1e6:
            raise StatedError(comment, f"{what}: {word} is no length")
        out.append(value)
    return out


def box(comment: Comment, low: Sequence[float], high: Sequence[float]) -> StatedStock:
    """A block between two corners (3,), units of the comment. Raises StatedError for an empty one."""
    if not all(a < b for a, b in zip(low, high, strict=True)):
        raise StatedError(comment, "the block has no room: its lower corner is not below its upper one")
    k = comment.unit_mm
    return StatedStock(comment, {"type": "box", "min_mm": _mm(low, k), "max_mm": _mm(high, k)})


def bar(comment: Comment, centre: Sequence[float], diameter: float, bottom: float, top: float) -> StatedStock:
    """A round bar along Z, units of the comment. Raises StatedError for an empty one."""
    if not (diameter > 0.0 and bottom < top):
        raise StatedError(comment, "the bar has no room: diameter and height have to be above zero")
    k = comment.unit_mm
    size, low, high = _mm((diameter, bottom, top), k)
    keys = {"type": "cylinder", "diameter_mm": size, "centre_mm": _mm(centre, k), "bottom_mm": low, "top_mm": high}
    return StatedStock(comment, keys)


def cutter(comment: Comment, kind: str, diameter: float, corner: float = 0.0, flute: float = 0.0) -> dict[str, Any]:
    """Keys of a tool from its sizes in units of the comment; kind: flat, ball, bull or drill."""
    k = comment.unit_mm
    if not diameter > 0.0:
        raise StatedError(comment, "the diameter of the tool is not above zero")
    if not 0.0 <= corner <= 0.501 * diameter:  # rounded, as in form_of
        raise StatedError(comment, f"a corner radius of {corner:g} does not fit a diameter of {diameter:g}")
    keys: dict[str, Any] = {"diameter_mm": _mm((diameter,), k)[0], "type": kind}
    if kind == "bull":
        keys["corner_radius_mm"] = _mm((corner,), k)[0]
    if flute > 0.0:
        keys["flute_length_mm"] = _mm((flute,), k)[0]
    return keys


def form_of(diameter: float, corner: float) -> str:
    """Form of a mill by its corner radius: flat, bull, or ball (radius equal to half the diameter)."""
    if not corner > 0.0:
        return "flat"
    return "ball" if corner > 0.499 * diameter else "bull"


def _mm(values: Sequence[float], unit: float) -> list[float]:
    return [round(unit * each, 6) for each in values]
