"""Kinds of output names: a file to be replaced, a stream to be written to, or neither; and identity of files."""

import os
import re
import stat
from collections.abc import Hashable, Sequence
from collections.abc import Set as AbstractSet
from pathlib import Path

from camcomp.ground.errors import FileError

STANDARD = "-"
_DESCRIPTOR = re.compile(r"/(?:dev|proc/self)/fd/(\d+)")
_DESCRIPTORS = {"/dev/stdin": 0, "/dev/stdout": 1, "/dev/stderr": 2}
_LINKS = 40  # as many as the kernel follows


def stream_at(path: str) -> str | int | None:
    """The pipe or character device called `path`, or the number of an open descriptor; None for regular and new files."""
    if path == STANDARD:
        return 1
    if (number := _descriptor(path)) is not None:
        return number
    mode = _mode(path)
    return path if stat.S_ISFIFO(mode) or stat.S_ISCHR(mode) else None


def unusable(path: str) -> str | None:
    """Reason why a name of this kind cannot be an output, or None."""
    if path == STANDARD or _descriptor(path) is not None:
        return None
    if path.endswith(("/", os.sep)):
        return "the name is that of a folder"
    if os.path.islink(path) and os.path.islink(os.path.realpath(path)):
        return "its links lead round in a circle"
    mode = _mode(path)
    kinds = {"a folder": stat.S_ISDIR, "a socket": stat.S_ISSOCK, "a block device": stat.S_ISBLK}
    return next((f"it is {kind}" for kind, test in kinds.items() if test(mode)), None)


def one_place_each(outputs: Sequence[str], *sources: AbstractSet[Hashable], capitals_count: bool = False) -> None:
    """Raise FileError CC502 if two outputs, or an output and an input, are the same file under any names.

    sources: `source_places` of inputs. capitals_count: names that differ in capitals only are two files; on many
    disks they are one.
    """
    taken: dict[Hashable, str] = {}
    for path in outputs:
        places = _places(path, 1)
        if not capitals_count:
            places |= {str(place).casefold() for place in places if isinstance(place, Path)}
        if any(not known.isdisjoint(places) for known in sources):
            raise FileError("CC502", f"{_shown(path)} is an input and would be overwritten")
        for place in places:
            if place in taken:
                names = f"{_shown(taken[place])} and {_shown(path)}"
                hint = "give each output its own name"
                raise FileError("CC502", f"two outputs go to the same file: {names}", hint=hint)
        taken |= dict.fromkeys(places, path)


def source_places(path: str) -> set[Hashable]:
    """Identifiers by which an input is recognised under another name."""
    found = _places(path, 0)
    return {each for each in found if not (isinstance(each, Path) and each.is_char_device())}  # /dev/null, terminals


def _shown(path: str) -> str:
    return "standard output" if path == STANDARD else path


def _places(path: str, standard: int) -> set[Hashable]:
    """Identifiers of a file; standard: the descriptor of "-"."""
    number = standard if path == STANDARD else _descriptor(path)
    try:
        status = os.stat(path if number is None else number)
    except OSError:
        status = None
    found: set[Hashable] = set()
    if status is not None and (stat.S_ISREG(status.st_mode) or stat.S_ISFIFO(status.st_mode)):
        found.add((status.st_dev, status.st_ino))
    if number is not None:
        return found | {number}
    return found | {Path(os.path.realpath(path))}  # a loop of links is followed partly


def _mode(path: str) -> int:
    try:
        return os.stat(path).st_mode
    except OSError:
        return 0


def _descriptor(path: str) -> int | None:
    """Number of the open descriptor of a name such as /dev/stdout, or of a link to it."""
    for _ in range(_LINKS):
        whole = os.path.abspath(path)
        if whole in _DESCRIPTORS:
            return _DESCRIPTORS[whole]
        if match := _DESCRIPTOR.fullmatch(whole):
            return int(match[1])
        if not os.path.islink(whole):
            return None
        path = os.path.join(os.path.dirname(whole), os.readlink(whole))
    return None
