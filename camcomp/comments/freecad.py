"""FreeCAD's Makera post: `(@FC|TOOL|...)`, `(@FC|STOCK|...)`, `(@FC|ORIGIN|...)`."""

from collections.abc import Iterator, Sequence

from camcomp.comments._pipes import read_pipes
from camcomp.gcode.stated import Comment, Statement

TITLE = "FreeCAD (@FC|...)"
MARKS = (b"@FC|",)


def read(comments: Sequence[Comment]) -> Iterator[Statement]:
    """Tools and stock."""
    return read_pipes(comments, "FC")
