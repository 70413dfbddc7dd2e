"""Compilation of kernels by numba: decorators for entry functions and for functions inside them.

Only the entry functions, those that Python calls, are cached; the functions that they call are compiled into them.
"""

from __future__ import annotations

import functools
import gc
from collections.abc import Callable
from typing import Any

import numba as _numba

numba: Any = _numba  # its annotations leave out what it has

# Kernels allocate, raise and return no Python objects: numba's support for that costs compile time.
_OPTIONS = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}


def inner(function: Callable[..., Any], *, fastmath: bool = False) -> Any:
    """Compile a function that only compiled functions call, without allocation, interpreter lock and exceptions.

    fastmath: sums may be formed in any order, which allows vector instructions. Constant arguments count as plain numbers:
    numba would otherwise compile the function for every constant.
    """
    if numba.config.DISABLE_JIT:  # for the debugger
        return function
    from camcomp.ground.linked_code import jit, linking_options

    dispatcher = jit(function, fastmath=fastmath, no_cpython_wrapper=True, **linking_options(), **_OPTIONS)
    template = getattr(dispatcher, "get_call_template", None)
    if template is not None:  # a numba without it compiles more

        def plain(args: Any, kws: Any) -> Any:
            return template(tuple(numba.core.types.unliteral(a) for a in args), kws)

        dispatcher.get_call_template = plain
    return dispatcher


def entry(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that Python calls, cached on disk until its source or the source of its callees changes.

    Without a cache folder every process compiles anew. Garbage collection is disabled meanwhile, which saves a sixth of the
    time.
    """
    if numba.config.DISABLE_JIT:
        return function
    from camcomp.ground.machine_code import kept  # slow import, needed to compile only

    dispatcher = kept(function, allocates=False, **_OPTIONS)

    @functools.wraps(function)
    def call(*args: Any) -> Any:
        if getattr(dispatcher, "overloads", None):  # not its `signatures`, which makes a list every time
            return dispatcher(*args)
        from camcomp.ground import progress

        resting = gc.isenabled()
        gc.disable()
        try:
            return dispatcher(*args)
        finally:
            progress.hold("")
            if resting:
                gc.enable()

    call.dispatcher = dispatcher  # type: ignore[attr-defined]
    return call


def direct(function: Callable[..., Any], args: tuple[Any, ...]) -> Callable[..., Any]:
    """Machine code of an entry function for exactly the types of `args`, with which it has been called before.

    Calling it avoids numba's dispatch by types, which takes longer than a small kernel.
    """
    dispatcher: Any = getattr(function, "dispatcher", None)
    try:
        out: Callable[..., Any] = dispatcher.overloads[tuple(map(dispatcher.typeof_pyval, args))].entry_point
    except AttributeError:  # not compiled, or a numba without these names
        return function
    return out
