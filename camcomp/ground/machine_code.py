"""Compiled functions and their code on disk: whole, for exactly this source, numba and processor, or compiled anew.

numba trusts its files. A damaged one ends the process or computes something else, and two processes that fill an empty
cache at once can each put its code under the other's name. Here every file has a checksum and one name for all that it
depends on, and whatever goes wrong with it is a note, never an error.

An installed camcomp brings code along that numba has already been through: what is left for the first run is to make
machine code of it, for the processor it finds. hatch_build.py makes these files; where they are missing or of other
sources, Python or numba, everything is compiled.
"""

from __future__ import annotations

import hashlib
import os
import pickle
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar

import llvmlite
import numba
from numba.core import caching

from camcomp.ground import headway
from camcomp.ground.linked_code import Entry, finished
from camcomp.ground.notes import note
from camcomp.ground.replacement import Replacement

_numba: Any = numba  # its annotations leave out what it has
_caching: Any = caching
_SUM = hashlib.sha256().digest_size
_ANEW = "it is compiled anew, which takes half a minute"
BROUGHT_ALONG = Path(__file__).parents[1] / "data" / "linked"


class _Bringing:
    """Where code to bring along is put while it is made, or None."""

    folder: Path | None = None


def bring_along(folder: Path) -> None:
    """What is compiled from now on in this process is also put there as code to bring along."""
    _Bringing.folder = folder


def kept(function: Callable[..., Any], *, digest: str | None = None, **options: Any) -> Any:
    """Numba's dispatcher of `function`, its code kept on disk where there is a place for it; options as for njit.

    digest: of all sources of the code; without it the code depends on the function's own file only, and is not brought
    along.
    """
    if _numba.config.DISABLE_JIT:  # for the debugger
        return _numba.njit(**options)(function)
    dispatcher = _numba.njit(pipeline_class=Entry, **options)(function)
    try:
        dispatcher._cache = _Cache(function, digest)
    except (OSError, RuntimeError):  # numba has found no place
        _not_kept("no folder for it can be written to")
    return dispatcher


def _not_kept(reason: str) -> None:
    note(
        "compiled code",
        f"compiled code cannot be kept ({reason}): {_ANEW} in every process; NUMBA_CACHE_DIR names a folder",
    )


class _UserWide(_caching.UserWideCacheLocator):  # type: ignore[misc]
    """The user's cache folder, for users who have one: without a home it would be one in the current folder, called ~."""

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> Any:
        known = os.path.isabs(cls(py_func, py_file).get_cache_path())
        return super().from_function(py_func, py_file) if known else None


class _Place(_caching.CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes: ClassVar = [_caching.UserProvidedCacheLocator, _caching.InTreeCacheLocator, _UserWide]


class _Cache(_caching.FunctionCache):  # type: ignore[misc]
    _impl_class = _Place

    def __init__(self, function: Callable[..., Any], digest: str | None) -> None:
        super().__init__(function)
        self._base, self._digest = self._impl.filename_base, digest
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _CodeFiles(Path(self._cache_path), self._base, (stamp, digest) if digest else stamp)

    def _load_overload(self, signature: Any, context: Any) -> Any:
        try:
            return super()._load_overload(signature, context) or self._load_linked(signature, context)
        except Exception:  # noqa: BLE001 - whatever a file makes numba do, there is another way
            note("compiled code", f"compiled code on the disk is damaged: {_ANEW}")
            return None

    def _load_linked(self, signature: Any, context: Any) -> Any:
        """Code that was brought along, made machine code and kept like other code; None when there is none."""
        codegen = context.codegen()
        data = self._linked_in(BROUGHT_ALONG).load(self._linked_key(signature, codegen)) if self._digest else None
        if data is None:
            return None
        headway.hold(headway.ONCE)
        result = finished(context, data)
        self._save_overload(signature, result)
        return result

    def _linked_in(self, folder: Path) -> _CodeFiles:
        return _CodeFiles(folder, self._base, self._digest)

    def _linked_key(self, signature: Any, codegen: Any) -> tuple[Any, ...]:
        """The key of machine code without the processor; what is left of it is the kind of machine."""
        signature, (machine, *_), code = self._index_key(signature, codegen)
        return signature, machine, code

    def _save_overload(self, signature: Any, data: Any) -> None:
        try:
            super()._save_overload(signature, data)
            if _Bringing.folder is not None and self._digest:
                linked = (data.library.linked, *self._impl.reduce(data)[1:])
                self._linked_in(_Bringing.folder).save(self._linked_key(signature, data.codegen), linked)
        except Exception as error:  # noqa: BLE001 - the code itself is there and works
            _not_kept(getattr(error, "strerror", None) or str(error))


class _CodeFiles:
    """In place of numba's index and data files: a file per function, source and signature."""

    def __init__(self, folder: Path, base: str, source_stamp: Any) -> None:
        self._folder, self._base = folder, base
        self._source_stamp = source_stamp  # of what the code was made from; whoever knows of more sources adds them

    def load(self, key: Any) -> Any:
        """The code under `key`, None when there is none. Raises ValueError when the file is not what was written."""
        try:
            data = self._path(key).read_bytes()
        except OSError:
            return None
        if hashlib.sha256(data[_SUM:]).digest() != data[:_SUM]:
            raise ValueError("checksum")
        written_for, code = pickle.loads(data[_SUM:])
        return code if written_for == key else None

    def save(self, key: Any, code: Any) -> None:
        """Keeps code; that of other sources under the same name goes. Raises OSError, FileError."""
        data = _caching.dumps((key, code))
        with Replacement(str(self._path(key))) as file:
            file.file.write(hashlib.sha256(data).digest() + data)
            file.finish()
            file.move()
        for each in self._folder.glob(f"{self._base}-*.nbc"):
            if not each.name.startswith(self._stem()):
                with suppress(OSError):
                    each.unlink()

    def flush(self) -> None:
        """Forgets what is kept."""
        for each in self._folder.glob(f"{self._base}-*.nbc"):
            with suppress(OSError):
                each.unlink()

    def _stem(self) -> str:
        made_by = (numba.__version__, llvmlite.__version__, self._source_stamp)
        return f"{self._base}-{_short(made_by)}-"

    def _path(self, key: Any) -> Path:
        return self._folder / f"{self._stem()}{_short(key)}.nbc"


def _short(what: Any) -> str:
    return hashlib.sha256(repr(what).encode()).hexdigest()[:16]
