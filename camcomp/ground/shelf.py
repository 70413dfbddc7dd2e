"""Plug-ins by file name: a robot, dialect, force model or effect is one file in its folder, or one entry point.

The YAML name is the file name. A user's own plug-in is announced in the entry-point group `camcomp.<shelf>`. It is checked
against its contract (camcomp/plugins) when it is loaded: a plug-in that a run names is refused with CC280, others are
skipped with a warning. Tests check camcomp's own plug-ins; the code for users' plug-ins is imported only if there is one,
which keeps the start fast.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext, redirect_stdout
from difflib import get_close_matches
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

from camcomp.ground.errors import ConfigError, Location, PluginWarning, Terminated

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

SHELVES = ("robots", "dialects", "forces", "effects", "comments", "tool_tables")

_checked: dict[tuple[str, str], tuple[Any, Any]] = {}  # object of an entry point, and the same after its check


@cache
def _own(shelf: str) -> frozenset[str]:
    folder = Path(__file__).parent.parent / shelf
    return frozenset(each.name for each in iter_modules([str(folder)]) if not each.name.startswith("_"))


def _announced(shelf: str) -> list[EntryPoint]:
    """Entry points of users' plug-ins."""
    if not _some_are_announced(tuple(sys.path)):
        return []
    from importlib.metadata import entry_points  # slow import, needed with plug-ins of users only

    return list(entry_points(group=f"camcomp.{shelf}"))


@cache
def _some_are_announced(path: tuple[str, ...]) -> bool:
    """Whether a package on the search path announces plug-ins; a package in an archive counts as one that does."""
    folders = [Path(each) for each in path]
    if any(each.is_file() for each in folders):
        return True
    files = (file for each in folders if each.is_dir() for file in each.glob("*-info/entry_points.txt"))
    return any(b"[camcomp." in file.read_bytes() for file in files)


def is_own(shelf: str, name: str) -> bool:
    """Whether the member of this name is camcomp's own."""
    return name in _own(shelf)


def members(shelf: str) -> tuple[str, ...]:
    """Names of all members of a shelf, sorted, without importing them."""
    return tuple(sorted({*_own(shelf), *(each.name for each in _announced(shelf))}))


def load(shelf: str, name: str, *, at: Location | None = None) -> Any:
    """Load the member called `name`: a module of camcomp, or the object of an entry point.

    A file of camcomp has precedence over an entry point of the same name, so that installing a package cannot change the
    meaning of a shipped name.

    Raises:
        ConfigError: CC213, unknown name (lists the members); CC280, the entry point names no valid plug-in.
    """
    if name in _own(shelf):
        return import_module(f"camcomp.{shelf}.{name}")
    announced = {each.value: each for each in _announced(shelf) if each.name == name}
    if len(announced) > 1:
        both = " and ".join(sorted(_who(shelf, each) for each in announced.values()))
        raise ConfigError("CC280", f"two plug-ins have one name: {both}", at=at, hint="uninstall one of them")
    for each in announced.values():
        try:
            return _load(shelf, each)
        except ConfigError as error:
            where = f" ({error.at.file}:{error.at.line})" if at and error.at else ""
            raise ConfigError(
                error.rule, error.message + where, at=at or error.at, hint=error.hint
            ) from error.__cause__
    known = members(shelf)
    close = get_close_matches(name, known, n=1)
    start = f"did you mean '{close[0]}'? " if close else ""
    hint = f"{start}known {shelf}: {', '.join(known) or 'none'}"
    raise ConfigError("CC213", f"there is no {shelf.removesuffix('s')} called '{name}'", at=at, hint=hint)


def usable(shelf: str, without: Sequence[str] = ()) -> Iterator[tuple[str, Any]]:
    """Name and member for all of a shelf; an invalid one of the user is skipped with a PluginWarning."""
    own = _own(shelf)
    for each in _announced(shelf):
        if each.name in own:
            warn_left_out(f"{_who(shelf, each)}: the name belongs to camcomp's own")
    for name in members(shelf):
        if name in without:
            continue
        try:
            member = load(shelf, name)
        except ConfigError as error:
            place = f" ({error.at.file}:{error.at.line})" if error.at else ""
            warn_left_out(f"{error.message}{place}")
            continue
        yield name, member


def warn_left_out(why: str) -> None:
    """Warn that a plug-in of the user is not used."""
    warnings.warn(PluginWarning(f"left out: {why}"), stacklevel=3)


def blaming(shelf: str, name: str) -> AbstractContextManager[None]:
    """Context in which errors of a user's member become CC281; those of camcomp's own members pass unchanged."""
    if name in _own(shelf):
        return nullcontext()
    from camcomp.ground.blame import blamed

    return blamed(next((_who(shelf, each) for each in _announced(shelf) if each.name == name), name))


def _load(shelf: str, announced: EntryPoint) -> Any:
    from camcomp.ground.blame import place_of
    from camcomp.ground.old_names import keep_old_names

    keep_old_names()
    who, key = _who(shelf, announced), (shelf, announced.name)
    try:
        with redirect_stdout(sys.stderr):  # standard output is for data
            found = announced.load()
    except (KeyboardInterrupt, Terminated):
        raise
    except BaseException as error:
        what = f"{type(error).__name__}: {error}".rstrip(": ")
        raise ConfigError("CC280", f"{who} cannot be imported: {what}", at=place_of(error)) from error
    if key not in _checked or _checked[key][0] is not found:
        contract = import_module(f"camcomp.plugins.{shelf}")
        with redirect_stdout(sys.stderr):
            _checked[key] = found, contract.checked(announced.name, found, who)
    return _checked[key][1]


def _who(shelf: str, each: EntryPoint) -> str:
    package = f" of {each.dist.name} {each.dist.version}" if each.dist is not None else ""
    return f"{shelf.removesuffix('s')} '{each.name}' (entry point {each.name} = {each.value}{package})"
