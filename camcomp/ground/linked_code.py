"""Compilation of functions that only compiled functions call: to LLVM code, which is linked into their callers.

By default numba optimises every function to machine code, and again as a part of each caller. Omitting the unused machine
code reduces the first `compensate` from 36 s to 20 s. The classes of numba used here are private; with a numba in which
the trial `is_usable` fails, functions are compiled as usual.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from types import FunctionType, ModuleType
from typing import Any

import numba as _numba

from camcomp.ground.native_code import INNER

numba: Any = _numba  # its annotations are incomplete


# Kernels allocate, raise and return no Python objects: numba's support for that costs compile time.
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}


def dispatcher(function: Callable[..., Any], allocates: bool) -> Any:
    """Numba's dispatcher of an entry function; allocates: with numba's support for arrays and exceptions."""
    for module in list(sys.modules.values()):
        for name, value in list(vars(module).items()) if isinstance(module, ModuleType) else ():
            if isinstance(value, FunctionType) and value in INNER:
                setattr(module, name, inner(value, *INNER[value]))
    return jit(function, **({} if allocates else _OPTIONS))


@functools.cache
def inner(function: Callable[..., Any], fastmath: bool = False, allocates: bool = False) -> Any:
    """Numba's dispatcher of a function that only compiled functions call.

    Constant arguments count as plain numbers: numba would otherwise compile the function for every constant.
    """
    if allocates:
        return jit(function)
    found = jit(function, fastmath=fastmath, no_cpython_wrapper=True, **linking_options(), **_OPTIONS)
    template = getattr(found, "get_call_template", None)
    if template is not None:  # a numba without it compiles more

        def plain(args: Any, kws: Any) -> Any:
            return template(tuple(numba.core.types.unliteral(a) for a in args), kws)

        found.get_call_template = plain
    return found


def jit(function: Callable[..., Any], fastmath: bool = False, **saving: Any) -> Any:
    """Numba's dispatcher of a function. saving: options that only save compile time, left out with a numba without them."""
    try:
        return numba.njit(fastmath=fastmath, **saving)(function)
    except (KeyError, TypeError):
        return numba.njit(fastmath=fastmath, nogil=True, error_model="numpy")(function)


@functools.cache
def linking_options() -> dict[str, Any]:
    """Options of njit for a function that compiled functions call; none where numba lacks the classes."""
    try:
        from numba.core.compiler import CompilerBase, DefaultPassBuilder
    except ImportError:
        return {}
    base: Any = CompilerBase

    class Inner(base):  # type: ignore[misc]
        def define_pipelines(self) -> list[Any]:
            """The passes of numba, with a library that is not optimised if numba permits it."""
            state = self.state
            state.flags.noalias = bool(state.flags.fastmath)  # saves checks in front of every loop
            if _trying or is_usable():
                state.library = _part_class()(state.targetctx.codegen(), state.func_id.func_qualname)
                state.library.enable_object_caching()
            return [DefaultPassBuilder.define_nopython_pipeline(state)]

    return {"pipeline_class": Inner}


_trying: list[bool] = []  # not empty while the trial compiles


@functools.cache
def is_usable() -> bool:
    """Whether this numba compiles a small function and its caller this way, with the correct result."""
    _trying.append(True)
    try:
        part = numba.njit(no_cpython_wrapper=True, **linking_options())(_doubled)
        whole = numba.njit(_calling(part))
        return bool(whole(20.0) == 41.0)
    except Exception:  # noqa: BLE001 - any error of another numba version means the usual compilation
        return False
    finally:
        _trying.clear()


def _doubled(x: float) -> float:
    return x + x


def _calling(part: Any) -> Any:
    def whole(x: float) -> Any:
        return part(x) + 1.0

    return whole


@functools.cache
def _part_class() -> Any:
    """Class of LLVM code to be linked into callers; it never becomes machine code and has no function pointer."""
    from numba.core.codegen import JITCodeLibrary

    library: Any = JITCodeLibrary

    class UnfinishedCode(library):  # type: ignore[misc]
        def __init__(self, codegen: Any, name: str) -> None:
            super().__init__(codegen, name)
            self._codegen = _WithoutPlace(codegen)

        def finalize(self) -> None:
            """Link its callees into it."""
            self._raise_if_finalized()
            for each in dict.fromkeys(self._linking_libraries):
                self._reload_init.update(each._reload_init)
                self._final_module.link_in(each._get_module_for_linking(), preserve=True)
            self._final_module.verify()
            self._finalized = True

        def get_pointer_to_function(self, name: str) -> int:
            """Return 0: no function pointer."""
            self._ensure_finalized()
            return 0

    return UnfinishedCode


class _WithoutPlace:
    """A code generator for code without an address in memory, which ignores writes to it."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, env: Any) -> None:
        """Ignore the environment, which only functions that raise or call Python need."""
