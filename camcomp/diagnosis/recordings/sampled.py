"""Result type of all readers of recordings, and their common helpers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import CamcompError, ConfigError, Location


@dataclass(frozen=True, eq=False, kw_only=True)
class SampledColumns:
    """Columns sampled together, n rows each.

    file: name for messages; units: as stated by the recording, "SI", or empty; time (n,) s on any clock, NaN for rows without
    one, or None; read: values (n,) of a column by its number; at: location of a cell by row (-1: header) and column; notes:
    omissions and assumptions of the reader; headed: the names are the recording's own.
    """

    file: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    time: Floats | None
    read: Callable[[int], Floats]
    at: Callable[[int, int], Location]
    notes: tuple[str, ...] = ()
    headed: bool = True


def of_values(
    file: str, names: Sequence[str], units: Sequence[str], values: Sequence[Floats], *, time: Floats | None,
    notes: Sequence[str],
) -> SampledColumns:  # fmt: skip
    """Columns of values (n,) that a container holds as numbers: their cells have no location of their own."""
    return SampledColumns(
        file=file, names=tuple(names), units=tuple(units), time=time, read=values.__getitem__,
        at=lambda row, column: Location(file, 1, 1), notes=tuple(notes),
    )  # fmt: skip


def library(module: str, package: str, what: str) -> Any:
    """Import an optional module. Raises ConfigError CC216 with the package to install."""
    try:
        return import_module(module)
    except ImportError as error:
        hint = "pip install 'camcomp[import]'"
        raise ConfigError("CC216", f"{what} need the package {package}", hint=hint) from error


@contextmanager
def reading(name: str, what: str) -> Iterator[None]:
    """Context that converts any exception of a library about a damaged file to ConfigError CC452."""
    try:
        yield
    except CamcompError:
        raise
    except Exception as error:  # libraries raise various types
        reason = (str(error) or type(error).__name__).splitlines()[0][:200]
        message = f"not {what} that can be read: {reason}"
        raise ConfigError("CC452", message, at=Location(name, 1, 1)) from error


def refuse_names(parts: Sequence[SampledColumns], names: Sequence[Sequence[str]]) -> None:
    """Raise ConfigError CC421 for names that are given although every part of a run has its own."""
    if names and all(part.headed for part in parts):
        hint = "name columns by --column LOG=THEIRS instead of --columns"
        raise ConfigError("CC421", "the recording has names of its own", at=parts[0].at(-1, 0), hint=hint)


def some(names: Sequence[str], most: int = 8) -> str:
    """Names for a message, the first of many."""
    listed = ", ".join(names[:most])
    return listed if len(names) <= most else f"{listed} and {len(names) - most} more"
