"""Bytes of a program as text with numbered lines, so that writing the text back gives the same bytes.

Words of a program are ASCII in all encodings in use; only comments are not. One-byte encodings and UTF-8 are therefore kept
as one character per byte, which is lossless; only UTF-16 is decoded.
"""

import re
from functools import cached_property

import numpy as np

from camcomp.ground.datatypes import Ints
from camcomp.ground.errors import Location, ProgramError
from camcomp.ground.records import dataclass

END_OF_LINE = r"\r{0,3}\n|\r"  # LF, CR LF and CR, and the CR CR LF of files that were converted twice
_END = re.compile(END_OF_LINE)
LONGEST_LINE = 1 << 14  # characters; controllers read some hundred
_UTF16 = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


def count_lines(data: bytes) -> int:
    """Ends of lines in a program's bytes."""
    return len(re.findall(END_OF_LINE.encode(), data)) if b"\r" in data else data.count(b"\n")


@dataclass(frozen=True, eq=False)
class Text:
    """A program's characters. `encode(string)` is the inverse of reading; `starts`/`ends` bound each line."""

    name: str
    string: str
    codec: str  # latin-1 (one character per byte), utf-16-le or utf-16-be
    mark: bytes  # byte order mark, not part of `string`

    @classmethod
    def read(cls, data: bytes, name: str) -> "Text":
        """Text of `data`. Raises ProgramError CC128 for invalid UTF-16, CC140 for a line over LONGEST_LINE."""
        text = cls._decoded(data, name)
        if len(text) and (length := int((text.ends - text.starts).max())) > LONGEST_LINE:
            at = Location(name, int(np.argmax(text.ends - text.starts)) + 1, 1)
            raise ProgramError("CC140", f"the line has {length} characters, more than {LONGEST_LINE}", at=at)
        return text

    @classmethod
    def _decoded(cls, data: bytes, name: str) -> "Text":
        codec = _UTF16.get(data[:2])
        if codec is None:
            mark = b"\xef\xbb\xbf" if data.startswith(b"\xef\xbb\xbf") else b""
            return cls(name, data[len(mark) :].decode("latin-1"), "latin-1", mark)
        try:
            string = data[2:].decode(codec, "surrogatepass")
        except UnicodeDecodeError as error:
            raise ProgramError(
                "CC128", f"marked as UTF-16, and is none at byte {error.start + 2}", at=Location(name, 1, 1)
            ) from None
        return cls(name, string, codec, data[:2])

    def encode(self, string: str) -> bytes:
        """Bytes of a changed text, in the encoding and with the byte order mark of this one."""
        errors = "surrogatepass" if self.codec != "latin-1" else "strict"
        return self.mark + string.encode(self.codec, errors)

    @cached_property
    def _bounds(self) -> tuple[Ints, Ints, Ints]:
        string = self.string
        if "\r" not in string and self.codec == "latin-1":
            breaks = np.flatnonzero(np.frombuffer(string.encode("latin-1"), np.uint8) == 10)
            nexts = breaks + 1
        else:
            spans = [each.span() for each in _END.finditer(string)]
            breaks, nexts = np.array(spans, np.int64).reshape(-1, 2).T
        starts = np.concatenate([[0], nexts]).astype(np.int64)
        ends = np.concatenate([breaks, [len(string)]]).astype(np.int64)
        # Text after the last end of line is a line only if it is not empty.
        full = np.concatenate([nexts, [len(string)]]).astype(np.int64)
        if len(starts) > 1 and starts[-1] == len(string):
            starts, ends, full = starts[:-1], ends[:-1], full[:-1]
        return starts, ends, full

    @property
    def starts(self) -> Ints:
        """(lines,) index of each line's first character."""
        return self._bounds[0]

    @property
    def ends(self) -> Ints:
        """(lines,) index behind each line's last character, before the end of line."""
        return self._bounds[1]

    @property
    def nexts(self) -> Ints:
        """(lines,) index behind each line's end of line."""
        return self._bounds[2]

    def __len__(self) -> int:
        return len(self.starts)

    def line(self, index: int) -> str:
        """Characters of line `index` (from 0), without its end of line."""
        return self.string[self.starts[index] : self.ends[index]]

    def rows_with(self, pattern: str) -> list[int]:
        """Lines in which a regular expression matches, ascending."""
        at = [found.start() for found in re.finditer(pattern, self.string)]
        return sorted({*(np.searchsorted(self.starts, at, side="right") - 1).tolist()})

    def end_of_line(self, index: int) -> str:
        """End of line `index`; for an unterminated last line that of the line before, or LF."""
        for each in (index, index - 1):
            if 0 <= each and self.ends[each] < self.nexts[each]:
                return self.string[self.ends[each] : self.nexts[each]]
        return "\n"

    def readable(self, string: str) -> str:
        """A piece of the text for display: decoded as UTF-8 if valid, else as Western European."""
        if self.codec != "latin-1":
            return string
        raw = string.encode("latin-1")
        try:
            return raw.decode("utf-8")
        except UnicodeDecodeError:
            return raw.decode("cp1252", "replace")

    def place(self, index: int, column: int = 0) -> Location:
        """Location of character `column` (from 0) of line `index` (from 0), for a message."""
        line = self.line(index) if 0 <= index < len(self) else ""
        before = self.readable(line[:column])
        return Location(self.name, index + 1, len(before) + 1, self.readable(line).rstrip("\0"))
