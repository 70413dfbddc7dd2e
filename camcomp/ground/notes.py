"""Notes to the user from inside the library, once per topic: on standard error, or held for the parent process."""

import sys

from camcomp.ground.errors import shown

_told: set[str] = set()
_held: dict[str, str] | None = None


def note(topic: str, text: str) -> None:
    """Print `text`, unless `topic` already had a note."""
    if topic in _told:
        return
    _told.add(topic)
    if _held is not None:
        _held[topic] = text
    elif sys.stderr is not None:
        print(f"camcomp: note: {shown(text)}", file=sys.stderr)


def hold() -> None:
    """Collect notes for `held` from now on, in workers whose parent prints them once for all."""
    global _held
    _held = {}


def held() -> dict[str, str]:
    """Collected notes by topic; they are removed from the collection."""
    found = dict(_held or {})
    if _held is not None:
        _held.clear()
    return found
