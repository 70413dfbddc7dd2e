"""A word to the user from deep inside, once per topic: to standard error, or held until somebody passes it on."""

import sys

from camcomp.ground.errors import shown

_told: set[str] = set()
_held: dict[str, str] | None = None


def note(topic: str, text: str) -> None:
    """Says `text` unless something was said on `topic` before."""
    if topic in _told:
        return
    _told.add(topic)
    if _held is not None:
        _held[topic] = text
    elif sys.stderr is not None:
        print(f"camcomp: note: {shown(text)}", file=sys.stderr)


def hold() -> None:
    """From now on notes wait for `held`: a worker's are its parent's to tell, who hears the same from others."""
    global _held
    _held = {}


def held() -> dict[str, str]:
    """Notes by topic that nobody has seen yet."""
    found = dict(_held or {})
    if _held is not None:
        _held.clear()
    return found
