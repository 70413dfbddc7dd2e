"""How functions that only compiled functions call are compiled: as far as LLVM code, which their callers take in.

By itself numba optimises every function and makes machine code of it, and again of each of those that call it. Where
only one of them is called from Python, code without a caller takes nearly half of the time: 20 s instead of 36 s for the
first `compensate`. The library of numba that this changes is private to numba. A numba in which it does not work compiles
as usual.
"""

from __future__ import annotations

import functools
from typing import Any

import numba as _numba

numba: Any = _numba  # its annotations leave out what it has

_compiler: Any = numba.core.compiler


class Inner(_compiler.CompilerBase):  # type: ignore[misc]
    """Numba's passes as far as LLVM code, for a function that compiled functions call."""

    def define_pipelines(self) -> list[Any]:
        """The passes of numba, for a library that is not optimised where numba permits it."""
        state = self.state
        if _trying or is_usable():
            state.library = _part_class()(state.targetctx.codegen(), state.func_id.func_qualname)
            state.library.enable_object_caching()
        return [_compiler.DefaultPassBuilder.define_nopython_pipeline(state)]


_trying: list[bool] = []  # not empty while the trial compiles


@functools.cache
def is_usable() -> bool:
    """Whether this numba compiles a small function and a caller of it this way, and the caller is right."""
    _trying.append(True)
    try:
        part = numba.njit(no_cpython_wrapper=True, pipeline_class=Inner)(_doubled)
        whole = numba.njit(_calling(part))
        return bool(whole(20.0) == 41.0)
    except Exception:  # noqa: BLE001 - whatever a numba of another build raises, it compiles as usual
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
    """Class of LLVM code to be taken in. It never becomes machine code, and there is no function to point to."""
    from numba.core.codegen import JITCodeLibrary

    library: Any = JITCodeLibrary

    class UnfinishedCode(library):  # type: ignore[misc]
        def __init__(self, codegen: Any, name: str) -> None:
            super().__init__(codegen, name)
            self._codegen = _WithoutPlace(codegen)

        def finalize(self) -> None:
            """Takes in what it calls."""
            self._raise_if_finalized()
            for each in dict.fromkeys(self._linking_libraries):
                self._reload_init.update(each._reload_init)
                self._final_module.link_in(each._get_module_for_linking(), preserve=True)
            self._final_module.verify()
            self._finalized = True

        def get_pointer_to_function(self, name: str) -> int:
            """None: 0."""
            self._ensure_finalized()
            return 0

    return UnfinishedCode


class _WithoutPlace:
    """A code generator for code that has no place in memory: what numba would write there is passed over."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, env: Any) -> None:
        """Environments serve functions that raise or call Python; these do neither."""
