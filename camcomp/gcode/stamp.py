"""The mark that camcomp leaves in what it writes, so that no program is compensated twice."""

import hashlib
import re

from camcomp.gcode.text import Text

_STAMP = re.compile(r"^[ \t]*[(;][ \t]*camcomp [0-9][^ )]* sha256:[0-9a-f]{64}\b", re.MULTILINE)


def is_stamped(data: bytes) -> bool:
    """True when the program was written by camcomp, whatever else was done to it since."""
    if not data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return _STAMP.search(data.decode("latin-1").replace("\r", "\n")) is not None
    string = data[2:].decode("utf-16-le" if data.startswith(b"\xff") else "utf-16-be", "replace")
    return _STAMP.search(string.replace("\r", "\n")) is not None


def stamp_line(data: bytes, version: str, opening: str = "(", closing: str = ")") -> str:
    """The comment that names camcomp, its version and the hash of the input."""
    return f"{opening}camcomp {version} sha256:{hashlib.sha256(data).hexdigest()}{closing}"


def stamp_index(text: Text) -> int:
    """Index of the character before which the stamp's line goes: the first, or behind a leading `%` line."""
    for index in range(len(text)):
        line = text.line(index).strip(" \t\0")
        if line.startswith("%"):
            return int(text.nexts[index])
        if line:
            break
    return 0
