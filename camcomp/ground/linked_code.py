"""How numba gets from Python to machine code: functions that others take in stay LLVM code, and are optimised with the whole.

By itself numba optimises every function and makes machine code of it, and again of each of those that call it. Where only
one of them is called from Python that is half of the work, for code that nobody calls. What is complete but not yet
optimised is the same for all processors of a kind, and can be put aside.
"""

from __future__ import annotations

from typing import Any

from llvmlite import binding
from numba.core import compiler
from numba.core.codegen import JITCodeLibrary

_compiler: Any = compiler  # its annotations leave out what it has
_binding: Any = binding
_Library: Any = JITCodeLibrary


class Entry(_compiler.CompilerBase):  # type: ignore[misc]
    """numba's way, for a function that Python calls."""

    def define_pipelines(self) -> list[Any]:
        """The passes of numba, for a library that puts aside what it consists of."""
        return _passes(self.state, Whole)


class Inner(_compiler.CompilerBase):  # type: ignore[misc]
    """numba's way as far as LLVM code, for a function that compiled functions call."""

    def define_pipelines(self) -> list[Any]:
        """The passes of numba, for a library that is not optimised."""
        return _passes(self.state, _Part)


def _passes(state: Any, library: Any) -> list[Any]:
    state.library = library(state.targetctx.codegen(), state.func_id.func_qualname)
    state.library.enable_object_caching()
    return [_compiler.DefaultPassBuilder.define_nopython_pipeline(state)]


class Whole(_Library):  # type: ignore[misc]
    """LLVM code of a function and all that it takes in."""

    linked: tuple[str, bytes]  # its name and the code, not yet optimised as a whole

    def _optimize_final_module(self) -> None:
        self.linked = self.name, self._final_module.as_bitcode()
        for function in self._final_module.functions:  # nobody else calls what it takes in
            if not function.is_declaration and function.linkage.name.startswith(("weak", "linkonce")):
                function.linkage = "internal"
        super()._optimize_final_module()


class _Part(_Library):  # type: ignore[misc]
    """LLVM code to be taken in. It never becomes machine code, and there is no function to point to."""

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self._codegen = _WithoutPlace(codegen)

    def finalize(self) -> None:
        """Takes in what it calls."""
        self._raise_if_finalized()
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._final_module.verify()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """None: 0."""
        self._ensure_finalized()
        return 0


class _WithoutPlace:
    """A code generator for code that has no place in memory: what numba would write there is passed over."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, env: Any) -> None:
        """Environments serve functions that raise or call Python; these do neither."""


class _Given:
    """A target context whose code generator has the library already that a compile result is rebuilt with."""

    def __init__(self, context: Any, library: Any) -> None:
        self._context, self._library = context, library

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def codegen(self) -> _Given:
        """In place of the true one."""
        return self

    def unserialize_library(self, data: Any) -> Any:
        """What is there."""
        return self._library


def finished(context: Any, data: tuple[Any, ...]) -> Any:
    """Compile result of what was put aside: `linked` of a Whole and the rest of a reduced compile result."""
    name, code = data[0]
    library = Whole(context.codegen(), name)
    library.enable_object_caching()
    library._final_module = _binding.parse_bitcode(code)
    library._final_module.name = name
    library._optimize_final_module()
    library._final_module.verify()
    library._finalize_final_module()
    result = _compiler.CompileResult._rebuild(_Given(context, library), *data)
    return result._replace(target_context=context)
