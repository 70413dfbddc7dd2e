"""Stock, tools and material in the comments that CAM systems write into programs.

`camcomp/comments` has one reader per notation. It gets the comments with its mark and returns their statements. Lengths are
in the unit of the comment, `Comment.unit_mm` mm each.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, BinaryIO

from camcomp.ground import shelf
from camcomp.ground.records import dataclass, field, replace

CHUNK = 1 << 16  # bytes read at once
MOVES = b"0123456789.+-XYZGFN \r\n\t"  # characters of linear moves
NEAR_LINES, NEAR_BYTES = (
    4,
    400,
)  # between a tool's comment and its T word: posts write stop, dwell and message in between
INCH_MM = 25.4
_UNIT_CODES = {b"20": INCH_MM, b"70": INCH_MM, b"700": INCH_MM, b"21": 1.0, b"71": 1.0, b"710": 1.0}
_COMMENT = re.compile(rb"\([^)\r\n]*\)|;[^\r\n]*")
_INSIDE = re.compile(rb"[A-Z#]")  # a letter behind one of these begins no word
_UNIT = re.compile(rb"G0*(20|21|700?|710?)(?![0-9.])")
_TOOL = re.compile(rb"T[ \t]*([0-9]{1,8})")
_OFFSET = re.compile(rb"G(5[4-9](?:\.[123])?)(?![0-9])")


@dataclass(frozen=True, kw_only=True)
class Comment:
    """A comment without its brackets. line, column: from 1; unit_mm: mm per unit of length in force there.

    next_tool: the next T word after it, or None. near_tool: the T word on the nearest line, 0 in a program without T words;
    None if no T word is near, or two are equally near.
    """

    line: int
    column: int
    text: str
    unit_mm: float
    next_tool: int | None = None
    near_tool: int | None = None


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
class StatedUnit:
    """The unit of length as named in the comment, mm each."""

    comment: Comment
    size_mm: float
    reader: str = ""


@dataclass(frozen=True)
class OpenStatement:
    """An ambiguous or incomplete statement in a comment, and the reason."""

    comment: Comment
    why: str
    reader: str = ""


Statement = StatedStock | StatedTool | StatedMaterial | StatedUnit | OpenStatement


@dataclass(kw_only=True)
class Stated:
    """All statements in the comments of a program.

    offsets: work offsets that the program uses, G54 to G59.3; has_unit: it has a code for the unit of length.
    """

    stocks: list[StatedStock] = field(default_factory=list)
    tools: list[StatedTool] = field(default_factory=list)
    materials: list[StatedMaterial] = field(default_factory=list)
    units: list[StatedUnit] = field(default_factory=list)
    doubts: list[OpenStatement] = field(default_factory=list)
    offsets: set[str] = field(default_factory=set)
    has_unit: bool = True

    def add(self, statement: Statement) -> None:
        """Add a reader's statement to its list."""
        match statement:
            case StatedStock():
                self.stocks.append(statement)
            case StatedTool():
                self.tools.append(statement)
            case StatedMaterial():
                self.materials.append(statement)
            case StatedUnit():
                self.units.append(statement)
            case OpenStatement():
                self.doubts.append(statement)


def read_stated(source: BinaryIO, unit_mm: float = 1.0) -> Stated:
    """Read the statements in a program's comments. source: seekable, at its start, and reset to it.

    unit_mm: of lengths in a program without a unit code.

    A comment with a reader's mark that the reader cannot parse is a doubt.
    """
    readers = [reader for _, reader in shelf.usable("comments")]
    if not _is_marked(source, [mark for reader in readers for mark in reader.MARKS]):
        return Stated()
    data = source.read()
    source.seek(0)
    words = _Words(data)
    comments = words.comments(b"|".join(re.escape(mark) for reader in readers for mark in reader.MARKS), unit_mm)
    out = Stated(has_unit=bool(words.units))
    for reader in readers:
        own = [each for each in comments if any(mark.decode() in each.text.upper() for mark in reader.MARKS)]
        try:
            for statement in reader.read(own):
                out.add(replace(statement, reader=reader.TITLE))
        except StatedError as error:
            out.add(OpenStatement(error.comment, str(error), reader.TITLE))
    out.offsets = {f"G{each.decode()}" for each in set(_OFFSET.findall(data.upper()))}
    return out


def read_each(comments: Iterable[Comment], read: Callable[[Comment], Statement | None]) -> Iterator[Statement]:
    """Statements of comments, one by one; a comment that `read` cannot parse (StatedError) is a doubt of its own."""
    for comment in comments:
        try:
            found = read(comment)
        except StatedError as error:
            found = OpenStatement(error.comment, str(error))
        if found is not None:
            yield found


class StatedError(ValueError):
    """A comment with a reader's mark that the reader cannot parse."""

    def __init__(self, comment: Comment, message: str) -> None:
        super().__init__(message)
        self.comment = comment


def _is_marked(source: BinaryIO, marks: Sequence[bytes]) -> bool:
    """Whether any mark (capitals) occurs in the source in any case; the source is reset to its start."""
    longest, rest = max(map(len, marks)), b""
    worded = all(mark.translate(None, MOVES) for mark in marks)
    try:
        while block := source.read(CHUNK):
            seen = rest + block
            if (seen.translate(None, MOVES) or not worded) and any(mark in seen.upper() for mark in marks):
                return True
            rest = block[-longest:]
        return False
    finally:
        source.seek(0)


class _Words:
    """Comments of a program, and the words outside of them that say in which unit and for which tool they are."""

    def __init__(self, data: bytes) -> None:
        self.data, self.capitals = data, data.upper()  # a search in one case is many times faster
        self.spans = [each.span() for each in _COMMENT.finditer(data)]
        self.starts = [start for start, _ in self.spans]
        self.units, self.tools = self._found(_UNIT), self._found(_TOOL)
        self.unit_at, self.tool_at = ([each.start() for each in found] for found in (self.units, self.tools))

    def comments(self, marks: bytes, unit_mm: float) -> list[Comment]:
        """Comments with one of the marks (an expression of capitals), with the unit in force there.

        Before the first unit code the unit is that of the program if it has a single one, else unit_mm.
        """
        data, marked = self.data, re.compile(marks)
        sizes = {_UNIT_CODES[each[1]] for each in self.units}
        first = sizes.pop() if len(sizes) == 1 else unit_mm
        out, line, begin = [], 1, 0
        for start, end in self.spans:
            if not marked.search(self.capitals, start, end):
                continue
            line, begin = line + data.count(b"\n", begin, start), start
            column = start - max(data.rfind(b"\n", 0, start), data.rfind(b"\r", 0, start))
            raw = data[start:end]
            text = (raw[1:-1] if raw.startswith(b"(") else raw[1:]).decode("utf-8", "replace").strip()
            unit, tool = bisect_left(self.unit_at, start), bisect_left(self.tool_at, end)
            size = _UNIT_CODES[self.units[unit - 1][1]] if unit else first
            after = int(self.tools[tool][1]) if tool < len(self.tools) else None
            near = self._near(tool, start, end)
            out.append(Comment(line=line, column=column, text=text, unit_mm=size, next_tool=after, near_tool=near))
        return out

    def _near(self, after: int, start: int, end: int) -> int | None:
        """The T word on the nearest line; `after`: index of the first one behind the comment."""
        if not self.tools:
            return 0
        near: list[tuple[int, int]] = []
        for index in (after - 1, after):
            if 0 <= index < len(self.tools):
                between = sorted((self.tool_at[index], start if index < after else end))
                if between[1] - between[0] <= NEAR_BYTES:
                    near.append((self.data.count(b"\n", *between), int(self.tools[index][1])))
        lines, number = min(near, default=(NEAR_LINES + 1, None))
        tied = any(each != number for count, each in near if count == lines)
        return None if tied or lines > NEAR_LINES else number

    def _found(self, pattern: re.Pattern[bytes]) -> list[re.Match[bytes]]:
        """Matches of a pattern at the start of a word and outside of the comments."""
        out = []
        for each in pattern.finditer(self.capitals):
            at = each.start()
            before = bisect_right(self.starts, at) - 1
            outside = before < 0 or at >= self.spans[before][1]
            if outside and not (at and _INSIDE.match(self.capitals, at - 1)):
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
