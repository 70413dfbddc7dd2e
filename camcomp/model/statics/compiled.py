"""How the solver's functions are compiled, and how their cache on disk knows that it is out of date.

Only the entry functions, those that Python calls, are cached; what they call is compiled into them. The cache knows the
entry's own file, so a digest of all files that functions and constants come from is added to what it compares.
"""

from __future__ import annotations

import functools
import gc
import hashlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core.types import unliteral

# Nothing is allocated, raised or handed to Python inside: what numba would build for that costs time to compile.
_OPTIONS = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
_numba: Any = numba  # its annotations leave out what it has


ROOT = Path(__file__).parents[3]  # of the package
_IMPORT = re.compile(r"^(?:from (camcomp[\w.]*) import (\([^)]*\)|.*)|import (camcomp[\w.]*))", re.MULTILINE)


@functools.cache
def sources(file: Path) -> frozenset[Path]:
    """Files of camcomp from which a kernel's file takes functions or constants, by whatever way, itself included.

    All of it becomes part of the machine code: a constant as its value, a function as its instructions.
    """
    found, open_files = set(), [file]
    while open_files:
        each = open_files.pop()
        if each not in found:
            found.add(each)
            open_files += _imported(each)
    return frozenset(found)


@functools.cache
def _imported(file: Path) -> tuple[Path, ...]:
    """Files of camcomp that a file imports when it is itself imported."""
    found = []
    for module, names, alone in _IMPORT.findall(file.read_text(encoding="utf-8")):
        place = ROOT.joinpath(*(module or alone).split("."))
        below = [place / name for name in re.findall(r"\w+", names)]
        for each in (place, *below):
            found += [path for path in (each.with_suffix(".py"), each / "__init__.py") if path.is_file()]
    return tuple(found)


@functools.cache
def digest(file: Path) -> str:
    """Digest of the sources of a kernel's file."""
    return hashlib.sha256(b"".join(each.read_bytes() for each in sorted(sources(file)))).hexdigest()


def inner(function: Callable[..., Any], *, fastmath: bool = False) -> Any:
    """Compiles a function that only compiled functions call. It allocates nothing, needs no interpreter lock, never raises.

    fastmath: sums may be formed in any order, and so in vectors.

    Constants among its arguments count as plain numbers: numba would compile the function anew for every one of them,
    which takes half as long again.
    """
    if _numba.config.DISABLE_JIT:  # for the debugger
        return function
    from camcomp.ground.linked_code import Inner

    dispatcher = _numba.njit(no_cpython_wrapper=True, fastmath=fastmath, pipeline_class=Inner, **_OPTIONS)(function)
    template = dispatcher.get_call_template

    def plain(args: Any, kws: Any) -> Any:
        return template(tuple(unliteral(a) for a in args), kws)

    dispatcher.get_call_template = plain
    return dispatcher


def _load_lightly(cache: Any) -> None:
    """Lets compiled code be loaded without what numba imports in front of it, a quarter of a second of declarations.

    They serve compiling only: code that allocates nothing refers to none of them. Where there is nothing to load, or a
    numba is built otherwise, it goes its own way.
    """
    if not (hasattr(cache, "_load_overload") and hasattr(cache, "_guard_against_spurious_io_errors")):
        return
    whole = cache.load_overload

    def load(signature: Any, context: Any) -> Any:
        with cache._guard_against_spurious_io_errors():
            found = cache._load_overload(signature, context)
        if found is not None:
            return found
        from camcomp.ground import headway

        headway.hold(headway.ONCE)
        return whole(signature, context)

    cache.load_overload = load


def entry(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a function that Python calls, cached on disk for as long as nothing changes that goes into it.

    Where nothing can be cached it is compiled anew in every process. While compiling, the search for
    unreachable objects rests: it takes a sixth of the time and finds nothing.
    """
    if _numba.config.DISABLE_JIT:
        return function
    from camcomp.ground.machine_code import kept  # only those who compile need it

    dispatcher = kept(function, digest=digest(Path(function.__code__.co_filename)), **_OPTIONS)
    file = getattr(dispatcher._cache, "_cache_file", None)
    if file is not None:
        _load_lightly(dispatcher._cache)

    @functools.wraps(function)
    def call(*args: Any) -> Any:
        if dispatcher.overloads:  # not its `signatures`, which makes a list every time
            return dispatcher(*args)
        from camcomp.ground import headway

        resting = gc.isenabled()
        gc.disable()
        if file is None:
            headway.hold(headway.COMPILING)
        try:
            return dispatcher(*args)
        finally:
            headway.hold("")
            if resting:
                gc.enable()

    call.dispatcher = dispatcher  # type: ignore[attr-defined]
    return call


def direct(function: Callable[..., Any], args: tuple[Any, ...]) -> Callable[..., Any]:
    """An entry function for arguments of exactly the types of `args`, with which it has been called before.

    It is the machine code without numba's search for it, which takes longer than small work does.
    """
    dispatcher: Any = getattr(function, "dispatcher", None)
    if dispatcher is None:
        return function
    out: Callable[..., Any] = dispatcher.overloads[tuple(map(dispatcher.typeof_pyval, args))].entry_point
    return out
