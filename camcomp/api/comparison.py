"""Comparison of two tables of one program."""

from camcomp.diagnosis import compare as story
from camcomp.diagnosis.compare import Comparison, Difference
from camcomp.ground.errors import ConfigError

__all__ = ["Comparison", "Difference", "compare"]

_COLUMNS = {"s": "s_mm", "t": "t_s", "row": "row"}


def compare(a: str, b: str, by: str | None = None) -> Comparison:
    """Compare two logs or joint tables column by column. by: align by s, t or row; None: the first that both have.

    Raises ConfigError CC451 for tables that cannot be aligned.
    """
    first, second = story.read_columns(a), story.read_columns(b)
    try:
        return story.compare(first, second, _COLUMNS[by] if by else None)
    except ValueError as error:
        raise ConfigError("CC451", str(error)) from error
