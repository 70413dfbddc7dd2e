"""Numbers of source lines in messages."""

from collections.abc import Sequence

from camcomp.ground.datatypes import Ints

MOST_LINES = 10  # that a message names


def named_lines(lines: Sequence[int] | Ints) -> str:
    """Source lines in words: `source line 4`, `source lines 4, 5`, from MOST_LINES on with an ellipsis."""
    named = ", ".join(str(line) for line in lines[:MOST_LINES]) + (" ..." if len(lines) > MOST_LINES else "")
    return f"source line{'' if len(lines) == 1 else 's'} {named}"
