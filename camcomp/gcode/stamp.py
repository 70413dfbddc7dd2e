"""Stamp in compensated programs, by which a second compensation is refused."""

import hashlib
import re
import textwrap

from camcomp.gcode.text import Text

# A remark of Fanuc LS goes on in the next one.
_NEXT_REMARK = rb"[ \t]*;[ \t]*[\r\n]+[ \t]*\d*[ \t]*:[ \t]*![ \t]*"
_GAP, _HEX = rb"(?: |" + _NEXT_REMARK + rb")", rb"(?:(?:" + _NEXT_REMARK + rb")?[0-9a-f])"
_STAMP = re.compile(
    rb"(?:^|[\r\n])[ \t]*(?:\d*[ \t]*:[ \t]*)?[(;!][ \t]*camcomp"
    + _GAP + rb"[0-9][^ );\r\n]*" + _GAP + rb"sha256:" + _HEX + rb"{64}(?![0-9a-f])"
)  # fmt: skip
_MODEL = re.compile(_STAMP.pattern + _GAP + rb"model:(" + _HEX + rb"{16})")
_MARKS = (b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")


def is_stamped(data: bytes) -> bool:
    """Whether a program contains camcomp's stamp, even if it was edited afterwards."""
    for mark in _MARKS:
        data = data.removeprefix(mark)
    # The stamp is ASCII, so without its zero bytes UTF-16 of either order reads like ASCII.
    return _STAMP.search(data.replace(b"\0", b"")) is not None


def stamp_line(data: bytes, version: str, opening: str = "(", closing: str = ")", model: str = "") -> str:
    """The comment with camcomp's version, the hash of the input, and that of machine and process if given."""
    return opening + stamp_text(hashlib.sha256(data).hexdigest(), version, model) + closing


def stamp_parts(data: bytes, version: str, model: str, width: int) -> list[str]:
    """Text of the stamp in parts of at most `width` characters; 0: one part."""
    text = stamp_text(hashlib.sha256(data).hexdigest(), version, model)
    return textwrap.wrap(text, width, break_on_hyphens=False) if width else [text]


def stamp_text(digest: str, version: str, model: str = "") -> str:
    """Text of the stamp without comment brackets."""
    return f"camcomp {version} sha256:{digest}" + (f" model:{model}" if model else "")


def stamped_model(data: bytes) -> str | None:
    """The hash of machine and process in a stamp, or None."""
    found = _MODEL.search(data.replace(b"\0", b""))
    return re.sub(_NEXT_REMARK, b"", found[1]).decode() if found else None


def stamp_index(text: Text) -> int:
    """Index at which the line of the stamp is inserted: the start, or behind a leading `%` line."""
    for index in range(len(text)):
        line = text.line(index).strip(" \t\0")
        if line.startswith("%"):
            return int(text.nexts[index])
        if line:
            break
    return 0
