"""Contract of readers of comments, checked when a user's reader is loaded."""

from collections.abc import Iterator, Sequence
from types import ModuleType
from typing import Any, Protocol

from camcomp.gcode.stated import Comment, Statement
from camcomp.plugins.contract import check_functions, check_module, check_names, refusal


class CommentsPlugin(Protocol):
    """One notation of stock and tools in comments. MARKS: words (in capitals) of such comments, matched in any case."""

    TITLE: str
    MARKS: tuple[bytes, ...]

    def read(self, comments: Sequence[Comment]) -> Iterator[Statement]:
        """Statements in comments that contain a mark, e.g. by `camcomp.gcode.stated.read_each`.

        StatedError for an unreadable one ends the reader, unless read_each meets it.
        """


def checked(name: str, found: Any, who: str) -> ModuleType:
    """The reader behind an entry point. Raises ConfigError CC280."""
    module = check_module(who, found)
    check_names(who, module, {"TITLE": str, "MARKS": tuple})
    check_functions(who, module, CommentsPlugin)
    if not module.MARKS or not all(isinstance(each, bytes) and each and each == each.upper() for each in module.MARKS):
        raise refusal(who, "MARKS is no tuple of byte strings in capitals")
    return module
