"""Compilation of kernels by numba: decorators for entry functions and for functions inside them.

Only the entry functions, those that Python calls, are cached; the functions that they call are compiled into them. Numba is
imported when something has to be compiled, and not to run what is in the cache.
"""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from typing import Any

_PLAIN_PYTHON = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")  # for the debugger


def inner(function: Callable[..., Any], *, fastmath: bool = False, allocates: bool = False) -> Any:
    """Mark a function that only compiled functions call.

    fastmath: sums may be formed in any order, and it writes to no array that overlaps another of its arguments, which allows
    vector instructions. allocates: the code creates arrays or raises.
    """
    from camcomp.ground.native_code import INNER

    INNER[function] = fastmath, allocates
    return function


def entry(function: Callable[..., Any], *, allocates: bool = False) -> Callable[..., Any]:
    """Compile a function that Python calls, cached on disk until its source or the source of its callees changes.

    Without a cache folder every process compiles anew. allocates: the code creates arrays or raises; to return an array it
    imports numba.
    """
    if _PLAIN_PYTHON:
        return function
    from camcomp.ground.machine_code import Cached
    from camcomp.ground.native_code import describe

    cached = Cached(function, allocates)
    runs: dict[tuple[Any, ...], Any] = {}

    @functools.wraps(function)
    def call(*args: Any) -> Any:
        try:
            types = describe(args)
        except TypeError:
            return cached.compiled(*args)
        run = runs.get(types)
        if run is None:
            run = runs[types] = cached.load(types, args)
        return run(None, args, None)

    call.load = cached.load  # type: ignore[attr-defined]
    return call


kept = functools.partial(entry, allocates=True)


def direct(function: Callable[..., Any], args: tuple[Any, ...]) -> Callable[..., Any]:
    """Machine code of an entry function for exactly the types of `args`.

    Calling it avoids the look at the types, which takes longer than a small kernel.
    """
    load: Any = getattr(function, "load", None)
    if load is None:
        return function
    from camcomp.ground.native_code import describe

    run = load(describe(args), args)
    return lambda *given: run(None, given, None)
