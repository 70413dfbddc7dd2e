"""Cache of compiled functions on disk, valid for exactly one state of source, numba and processor.

Every file has a checksum and a name made of all its dependencies; a failure is a note, never an error. Because the code is
executed, files and folders that other users own or can write to are not used. Numba's own cache has neither check.
"""

from __future__ import annotations

import functools
import gc
import hashlib
import os
import pickle
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from camcomp.ground import native_code, progress
from camcomp.ground.notes import note
from camcomp.ground.replacement import Replacement
from camcomp.ground.trust import why_file_is_not_ours, why_folder_is_not_ours

_SUM = hashlib.sha256().digest_size
_NOT_IN_CODE = {"NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS"}
_ANEW = "it is compiled anew, which takes half a minute"
ROOT = Path(__file__).parents[2]  # of the package
_IMPORT = re.compile(r"^(?:from (camcomp[\w.]*) import (\([^)]*\)|.*)|import (camcomp[\w.]*))", re.MULTILINE)


@functools.cache
def sources(file: Path) -> frozenset[Path]:
    """Files of camcomp from which a kernel's file imports functions or constants, directly or indirectly, and itself.

    All of them are part of the machine code: a constant as its value, a function as its instructions.
    """
    found, open_files = set(), [file]
    while open_files:
        each = open_files.pop()
        if each not in found:
            found.add(each)
            open_files += _read(each)[1]
    return frozenset(found)


@functools.cache
def _read(file: Path) -> tuple[bytes, tuple[Path, ...]]:
    """Digest of a file, and the files of camcomp that it imports at module level."""
    data, found = file.read_bytes(), []
    for module, names, alone in _IMPORT.findall(data.decode()):
        place = ROOT.joinpath(*(module or alone).split("."))
        below = [place / name for name in re.findall(r"\w+", names)] if place.is_dir() else []
        found += [path for each in (place, *below) for path in (each.with_suffix(".py"), each / "__init__.py")]
    return hashlib.sha256(data).digest(), tuple(path for path in found if path.is_file())


@functools.cache
def digest(file: Path) -> str:
    """Digest of the sources of a kernel's file."""
    return hashlib.sha256(b"".join(_read(each)[0] for each in sorted(sources(file)))).hexdigest()


def _not_kept(reason: str) -> None:
    note(
        "compiled code",
        f"compiled code cannot be kept ({reason}): {_ANEW} in every process; NUMBA_CACHE_DIR names a folder",
    )


def _folders(file: Path) -> Iterator[Path]:
    """Cache folders for a source file, the preferred one first.

    Of numba's settings only environment variables count, because a `.numba_config.yaml` belongs to the current folder.
    """
    kind = f"{file.parent.name}_{_short(str(file.parent))}"
    if given := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(given).absolute() / kind
    yield file.parent / "__pycache__"
    if (user := _user_cache()) is not None:
        yield user / "camcomp" / kind


def _user_cache() -> Path | None:
    """The user's cache folder; None if the home folder is unknown."""
    if sys.platform == "win32":
        places = [os.environ.get("LOCALAPPDATA", "")]
    elif sys.platform == "darwin":
        places = [os.path.expanduser("~/Library/Caches")]
    else:
        places = [os.environ.get("XDG_CACHE_HOME", ""), os.path.expanduser("~/.cache")]
    return next((Path(each) for each in places if os.path.isabs(each)), None)


def find_folder(file: Path) -> Path | None:
    """The first cache folder for `file` that only this user can write to, or None."""
    given = bool(os.environ.get("NUMBA_CACHE_DIR"))
    for number, folder in enumerate(_folders(file)):
        reason = why_folder_is_not_ours(folder)
        if reason is None:
            with suppress(OSError):
                if fresh := not folder.is_dir():
                    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
                if os.access(folder, os.W_OK | os.X_OK) and not (fresh and why_folder_is_not_ours(folder)):
                    return folder
        elif given and number == 0:
            note(
                "compiled code folder", f"NUMBA_CACHE_DIR is not used: {reason}, and code from there would be executed"
            )
    return None


class Cached:
    """A function that numba compiles once; its code is on disk if a folder is usable."""

    def __init__(self, function: Callable[..., Any], allocates: bool = False) -> None:
        code, self._function, self._allocates = function.__code__, function, allocates
        self._file = Path(code.co_filename)
        module = function.__module__.rpartition(".")[2]
        base = f"{module}.{function.__qualname__}-{code.co_firstlineno}.{sys.implementation.cache_tag}"
        self._base = re.sub(r"[^\w.-]", "_", base)
        self.hits = 0  # code that came from the disk

    @functools.cached_property
    def files(self) -> CodeFiles | None:
        """Files of the code; None if no folder is usable."""
        try:
            folder, stamp = find_folder(self._file), digest(self._file)
        except OSError:  # a function without a file
            return None
        return None if folder is None else CodeFiles(folder, self._base, stamp)

    @functools.cached_property
    def compiled(self) -> Any:
        """Numba's dispatcher."""
        from camcomp.ground.linked_code import dispatcher  # imports numba

        return dispatcher(self._function, self._allocates)

    def load(self, types: tuple[Any, ...], args: tuple[Any, ...]) -> native_code.Run:
        """Machine code for types of arguments, from the disk or compiled for `args`."""
        key: Any = None
        try:
            if self.files is not None:
                key = types, native_code.platform(), _settings()
                found = self.files.load(key)
                if found is not None:
                    run = native_code.load(self._base, native_code.ObjectCode(*found))
                    self.hits += 1
                    return run
        except Exception:  # noqa: BLE001 - any failure means compilation
            note("compiled code", f"compiled code on the disk is damaged: {_ANEW}")
        progress.hold(progress.COMPILING if self.files is None else progress.ONCE)
        resting = gc.isenabled()
        gc.disable()  # saves a sixth of the time
        try:
            self._save(key, self.compiled, self.compiled.compile(tuple(map(self.compiled.typeof_pyval, args))))
        except AttributeError:  # a numba without these names compiles when it is called
            _not_kept("another numba")
        finally:
            progress.hold("")
            if resting:
                gc.enable()
        return lambda _, given, __: self.compiled(*given)

    def _save(self, key: Any, dispatcher: Any, entry_point: Any) -> None:
        """Save the code of a dispatcher's newest signature."""
        if self.files is None:
            return _not_kept("no folder for it can be written to")
        try:
            result = next(each for each in dispatcher.overloads.values() if each.entry_point is entry_point)
            if result.library.has_dynamic_globals:
                raise ValueError("it holds addresses of this process")
            code = result.library.serialize_using_object_code()[2][0]
            symbols = result.fndesc.llvm_cpython_wrapper_name, result.fndesc.env_name
            constants = tuple(result.environment.consts)
            self.files.save(key, tuple(native_code.ObjectCode(code, *symbols, constants)))
        except Exception as error:  # noqa: BLE001 - the compiled code works without the cache
            _not_kept(getattr(error, "strerror", None) or str(error))


def _settings() -> tuple[tuple[str, str], ...]:
    """Numba's settings that can change the code."""
    return tuple(sorted((k, v) for k, v in os.environ.items() if k.startswith("NUMBA_") and k not in _NOT_IN_CODE))


class CodeFiles:
    """Files of compiled code, one per function, source and signature."""

    def __init__(self, folder: Path, base: str, source_stamp: str) -> None:
        self.folder, self._base = folder, base
        self._source_stamp = source_stamp  # digest of the sources

    def load(self, key: Any) -> Any:
        """Code under `key`, or None. Raises ValueError for a damaged file."""
        path = self._path(key)
        try:
            handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        except OSError:
            return None
        with os.fdopen(handle, "rb") as file:
            if (reason := why_file_is_not_ours(handle)) is not None:
                note("compiled code of others", f"compiled code is not used: {path} {reason}; {_ANEW}")
                return None
            data = file.read()
        if hashlib.sha256(data[_SUM:]).digest() != data[:_SUM]:
            raise ValueError("checksum")
        written_for, code = pickle.loads(data[_SUM:])
        return code if written_for == key else None

    def save(self, key: Any, code: Any) -> None:
        """Save code, and delete that of other sources under the same name. Raises OSError, FileError."""
        data = pickle.dumps((key, code))
        with Replacement(str(self._path(key)), mode=0o600) as file:
            file.file.write(hashlib.sha256(data).digest() + data)
            file.finish()
            file.move()
        for each in self.folder.glob(f"{self._base}-*.nbc"):
            if not each.name.startswith(self._stem()):
                with suppress(OSError):
                    each.unlink()

    def flush(self) -> None:
        """Delete the cached code."""
        for each in self.folder.glob(f"{self._base}-*.nbc"):
            with suppress(OSError):
                each.unlink()

    def leave(self, most: int) -> None:
        """Delete the oldest files of this name, so that `most` remain."""
        files = sorted(self.folder.glob(f"{self._base}-*.nbc"), key=lambda each: each.stat().st_mtime)
        for each in files[:-most]:
            each.unlink(missing_ok=True)

    def _stem(self) -> str:
        return f"{self._base}-{_short((*_compiler(), self._source_stamp))}-"

    def _path(self, key: Any) -> Path:
        return self.folder / f"{self._stem()}{_short(key)}.nbc"


@functools.cache
def _compiler() -> tuple[str, str]:
    """Versions of numba and llvmlite."""
    return _version("numba"), _version("llvmlite")


def _version(package: str) -> str:
    found = find_spec(package)
    file = Path(found.origin).with_name("_version.py") if found is not None and found.origin else None
    if file is not None and file.is_file():
        return hashlib.sha256(file.read_bytes()).hexdigest()
    from importlib.metadata import version  # slow import

    return version(package)


def _short(what: Any) -> str:
    return hashlib.sha256(repr(what).encode()).hexdigest()[:16]
