"""Plug-ins by file name: a robot, dialect, force model or effect is one file in its folder, or one entry point.

The YAML name is the file name. A user's own plug-in is announced in the entry-point group `camcomp.<shelf>`.
"""

import sys
from difflib import get_close_matches
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from camcomp.ground.errors import ConfigError, Location

SHELVES = ("robots", "dialects", "forces", "effects")


def _own(shelf: str) -> list[str]:
    folder = Path(__file__).parent.parent / shelf
    return [each.name for each in iter_modules([str(folder)]) if not each.name.startswith("_")]


# Where plug-ins written for the first releases import from, and what stands there now.
_MOVED = {"camcomp.gap.effect": "camcomp.model.effect", "camcomp.specbase": "camcomp.model.config.base"}


def _keep_old_names() -> None:
    """Lets a user's plug-in import what it always has."""
    for old, new in _MOVED.items():
        sys.modules.setdefault(old, import_module(new))


def members(shelf: str) -> tuple[str, ...]:
    """Names of all members of a shelf, sorted; nothing is imported."""
    return tuple(sorted({*_own(shelf), *(each.name for each in entry_points(group=f"camcomp.{shelf}"))}))


def load(shelf: str, name: str, *, at: Location | None = None) -> Any:
    """The member called `name`: a module of camcomp, or whatever its entry point names.

    An own file wins over an entry point of the same name, so that installing a package cannot change what a shipped
    name means. Raises ConfigError CC213, which lists what there is.
    """
    if name in _own(shelf):
        return import_module(f"camcomp.{shelf}.{name}")
    for each in entry_points(group=f"camcomp.{shelf}", name=name):
        _keep_old_names()
        return each.load()
    known = members(shelf)
    close = get_close_matches(name, known, n=1)
    start = f"did you mean '{close[0]}'? " if close else ""
    hint = f"{start}known {shelf}: {', '.join(known) or 'none'}"
    raise ConfigError("CC213", f"there is no {shelf.removesuffix('s')} called '{name}'", at=at, hint=hint)
