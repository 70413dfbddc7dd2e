"""How the solver's functions are compiled, and how their cache on disk knows that it is out of date.

Only the entry functions, those that Python calls, are cached; what they call is compiled into them. numba trusts its
cache while the entry's own file is unchanged, so a digest of all kernel sources is added to what it compares.
"""

from __future__ import annotations

import functools
import gc
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core.types import unliteral

SOURCES = ("compiled", "layout", "vectors", "kernel", "chain", "rigid", "point", "sweep", "gradients")
# Nothing is allocated, raised or handed to Python inside: what numba would build for that costs time to compile.
_OPTIONS = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
_numba: Any = numba  # its annotations leave out what it has


@functools.cache
def digest() -> str:
    """Digest of all kernel sources."""
    folder = Path(__file__).parent
    return hashlib.sha256(b"".join((folder / f"{name}.py").read_bytes() for name in SOURCES)).hexdigest()


def inner(function: Callable[..., Any]) -> Any:
    """Compiles a function that only compiled functions call. It allocates nothing, needs no interpreter lock, never raises.

    Constants among its arguments count as plain numbers: numba would compile the function anew for every one of them,
    which takes half as long again.
    """
    if _numba.config.DISABLE_JIT:  # for the debugger
        return function
    dispatcher = _numba.njit(no_cpython_wrapper=True, **_OPTIONS)(function)
    template = dispatcher.get_call_template

    def plain(args: Any, kws: Any) -> Any:
        return template(tuple(unliteral(a) for a in args), kws)

    dispatcher.get_call_template = plain
    return dispatcher


def entry(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a function that Python calls, cached on disk for as long as no kernel source changes.

    Where nothing can be cached (no writable folder) it is compiled anew in every process. While compiling, the search for
    unreachable objects rests: it takes a sixth of the time and finds nothing.
    """
    if _numba.config.DISABLE_JIT:
        return function
    try:
        dispatcher = _numba.njit(cache=True, **_OPTIONS)(function)
        file = dispatcher._cache._cache_file
        file._source_stamp = (file._source_stamp, digest())
    except RuntimeError:  # numba finds no place for its cache
        dispatcher = _numba.njit(**_OPTIONS)(function)

    @functools.wraps(function)
    def call(*args: Any) -> Any:
        if dispatcher.signatures:
            return dispatcher(*args)
        resting = gc.isenabled()
        gc.disable()
        try:
            return dispatcher(*args)
        finally:
            if resting:
                gc.enable()

    call.dispatcher = dispatcher  # type: ignore[attr-defined]
    return call
