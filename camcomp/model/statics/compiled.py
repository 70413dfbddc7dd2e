"""How the solver's functions are compiled.

Only the entry functions, those that Python calls, are cached; what they call is compiled into them.
"""

from __future__ import annotations

import functools
import gc
from collections.abc import Callable
from typing import Any

import numba as _numba

numba: Any = _numba  # its annotations leave out what it has

# Nothing is allocated, raised or handed to Python inside: what numba would build for that costs time to compile.
_OPTIONS = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}


def inner(function: Callable[..., Any], *, fastmath: bool = False) -> Any:
    """Compiles a function that only compiled functions call. It allocates nothing, needs no interpreter lock, never raises.

    fastmath: sums may be formed in any order, and so in vectors.

    Constants among its arguments count as plain numbers: numba would compile the function anew for every one of them,
    which takes half as long again.
    """
    if numba.config.DISABLE_JIT:  # for the debugger
        return function
    from camcomp.ground.linked_code import Inner

    dispatcher = numba.njit(no_cpython_wrapper=True, fastmath=fastmath, pipeline_class=Inner, **_OPTIONS)(function)
    template = getattr(dispatcher, "get_call_template", None)
    if template is not None:  # a numba without it compiles more

        def plain(args: Any, kws: Any) -> Any:
            return template(tuple(numba.core.types.unliteral(a) for a in args), kws)

        dispatcher.get_call_template = plain
    return dispatcher


def entry(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a function that Python calls, cached on disk for as long as nothing changes that goes into it.

    Where nothing can be cached it is compiled anew in every process. While compiling, the search for
    unreachable objects rests: it takes a sixth of the time and finds nothing.
    """
    if numba.config.DISABLE_JIT:
        return function
    from camcomp.ground.machine_code import kept  # only those who compile need it

    dispatcher = kept(function, allocates=False, **_OPTIONS)

    @functools.wraps(function)
    def call(*args: Any) -> Any:
        if dispatcher.overloads:  # not its `signatures`, which makes a list every time
            return dispatcher(*args)
        from camcomp.ground import headway

        resting = gc.isenabled()
        gc.disable()
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
