"""Names of codes for messages, from pygcode, which only this file imports.

pygcode covers RS274/NGC. It is used for names only, because it rounds numbers and misreads some.
"""

import warnings
from functools import cache


@cache
def _class_of(word: str) -> type | None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from pygcode import Word
        from pygcode.exceptions import GCodeParameterError, GCodeWordStrError
        from pygcode.gcodes import word_gcode_class
    try:
        out: type | None = word_gcode_class(Word(word))
        return out
    except (GCodeParameterError, GCodeWordStrError, ValueError):
        return None


def name_of(word: str) -> str:
    """`arc move (clockwise)` of `G2`; empty for a code unknown to pygcode."""
    found = _class_of(word)
    text = (found.__doc__ or "").strip().splitlines() if found is not None else []
    return text[0].rpartition(": ")[2].strip().lower() if text else ""


def named(word: str) -> str:
    """`G2 (arc move (clockwise))`, or the word alone."""
    name = name_of(word)
    return f"{word} ({name})" if name else word
