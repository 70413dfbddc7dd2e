"""Run machine code that numba compiled, without the import of numba, which takes a quarter of a second of every start.

Numba gives each function a wrapper with the calling convention of CPython; the object file holds both. LLVM links it with
the helpers of numba's extension modules, which load without the package.
"""

from __future__ import annotations

import ctypes
import functools
import importlib.util
from collections.abc import Callable
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

INNER: dict[Callable[..., Any], tuple[bool, bool]] = {}  # functions that only compiled ones call: fastmath, allocates
Run = Any  # (None, arguments, None) -> result
_ENVIRONMENTS: list[Any] = []  # of all linked code, which points at them as long as the engine lives
_KINDS = {np.dtype(each).str for each in ("f8", "f4", "i8", "u8", "i4", "i1", "u1", "?")}
_SCALARS = {bool: "|b1", int: "<i8", float: "<f8"}


class ObjectCode(NamedTuple):
    """Object file of a compiled function, its wrapper and its environment by symbol, and the objects that it asks for."""

    code: bytes
    wrapper: str
    environment: str
    constants: tuple[Any, ...]


def describe(values: tuple[Any, ...]) -> tuple[Any, ...]:
    """Types of arguments, as far as machine code depends on them. Raises TypeError for a type that numba has to judge."""
    found: list[Any] = []
    for value in values:
        kind = type(value)
        if kind is np.ndarray:
            flags = value.flags
            dtype = value.dtype.str
            if dtype not in _KINDS or not flags.aligned:
                raise TypeError(f"array of {dtype}")
            layout = "C" if flags.c_contiguous else "F" if flags.f_contiguous else "A"
            found.append((dtype, value.ndim, layout, flags.writeable))
        elif kind in _SCALARS:
            found.append(_SCALARS[kind])
        elif isinstance(value, tuple):
            found.append((kind.__qualname__, describe(value)))
        elif isinstance(value, np.generic) and value.dtype.str in _KINDS:
            found.append(value.dtype.str)
        else:
            raise TypeError(kind.__name__)
    return tuple(found)


@functools.cache
def platform() -> tuple[str, str, str]:
    """Triple, processor and its features, on which machine code depends."""
    import llvmlite.binding as llvm

    return llvm.get_process_triple(), llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def load(name: str, given: ObjectCode) -> Run:
    """The function in an object file. Raises whatever another build of numba or LLVM raises."""
    import llvmlite.binding as llvm

    environment = _link()({})
    environment.consts.extend(given.constants)
    engine = _engine()
    engine.add_object_file(llvm.ObjectFileRef.from_data(given.code))
    engine.finalize_object()
    at = engine.get_function_address(given.wrapper)
    place = engine.get_global_value_address(given.environment)
    if not at or not place:
        raise ValueError(f"no {name} in its object file")
    ctypes.c_void_p.from_address(place).value = id(environment)
    run: Any = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.py_object, ctypes.c_void_p)(at)
    _ENVIRONMENTS.append(environment)
    return run


@functools.cache
def _engine() -> Any:
    """The engine that links all object files; its memory holds their code."""
    import llvmlite.binding as llvm

    target = llvm.Target.from_default_triple().create_target_machine(opt=0, jit=True, codemodel="jitdefault")
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), target)


@functools.cache
def _link() -> Any:
    """Register the helpers of numba with LLVM. Returns the class of environments, which the wrappers ask for."""
    import llvmlite.binding as llvm

    helpers, functions, memory = (
        _extension("_helperlib"),
        _extension("_dynfunc"),
        _extension("core/runtime/_nrt_python"),
    )
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    for name, address in (*helpers.c_helpers.items(), *functions.c_helpers.items()):
        llvm.add_symbol(f"numba_{name}", address)
    for name, address in memory.c_helpers.items():
        llvm.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)
    return functions.Environment


def _extension(name: str) -> Any:
    """An extension module of numba, without its package."""
    package = importlib.util.find_spec("numba")
    assert package is not None and package.submodule_search_locations
    for folder in package.submodule_search_locations:
        for suffix in EXTENSION_SUFFIXES:
            path = Path(folder, name + suffix)
            if path.is_file():
                full = f"numba.{name}".replace("/", ".")
                loader = ExtensionFileLoader(full, str(path))
                spec = importlib.util.spec_from_file_location(full, path, loader=loader)
                assert spec is not None
                module = importlib.util.module_from_spec(spec)
                loader.exec_module(module)
                return module
    raise ImportError(f"numba has no {name}")
