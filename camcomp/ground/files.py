"""Disk access: bytes in, bytes out, `-` for the standard streams, several outputs all or none."""

import errno
import os
import shutil
import stat
import sys
from collections.abc import Hashable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import BinaryIO, cast

from camcomp.ground.errors import FileError
from camcomp.ground.places import STANDARD, one_place_each, source_places, stream_at, unusable
from camcomp.ground.replacement import Replacement


class _Inputs:
    """Inputs of the running command: protected against being overwritten, and kept if they can be read only once."""

    def __init__(self) -> None:
        self.places: set[Hashable] = set()
        self.kept: dict[str, bytes] = {}


_reading: list[_Inputs] = []  # innermost last; empty outside of commands


@contextmanager
def remembering_inputs() -> Iterator[None]:
    """Context in which inputs cannot be overwritten, and every read of a pipe returns the same bytes."""
    _reading.append(_Inputs())
    try:
        yield
    finally:
        _reading.pop()


def read_bytes(path: str | Path) -> bytes:
    """Content of a file, or of standard input for "-". Raises FileError CC500."""
    name = str(path)
    inputs = _reading[-1] if _reading else _Inputs()
    if name in inputs.kept:
        return inputs.kept[name]
    inputs.places |= source_places(name)
    try:
        if name == STANDARD:
            data, again = sys.stdin.buffer.read(), False
        else:
            data, again = Path(path).read_bytes(), stat.S_ISREG(os.stat(path).st_mode)
    except OSError as error:
        raise _unread(path, error) from error
    if not again:
        inputs.kept[name] = data
    return data


def _unread(path: str | Path, error: OSError) -> FileError:
    """Error with a hint: for a folder its files, for a misspelt name the nearest one."""
    from difflib import get_close_matches  # slow import, needed for errors only

    wanted, hint = Path(path), None
    if isinstance(error, IsADirectoryError):
        hint = "this is a folder: name a file in it"
    elif isinstance(error, FileNotFoundError) and wanted.parent.is_dir():
        close = get_close_matches(wanted.name, sorted(each.name for each in wanted.parent.iterdir()), n=1)
        hint = f"did you mean {wanted.parent / close[0]}?" if close else None
    return FileError("CC500", f"cannot read {display_name(path)}: {error.strerror}", hint=hint)


def open_source(path: str | Path) -> BinaryIO:
    """Open a seekable file; a pipe is copied to a temporary one. Raises FileError CC500."""
    try:
        if _reading:
            _reading[-1].places |= source_places(str(path))
        if str(path) != STANDARD:
            file = Path(path).open("rb")  # noqa: SIM115 - the caller closes it
            if file.seekable():
                return file
        else:
            file = sys.stdin.buffer  # type: ignore[assignment]
        aside = _aside()
        shutil.copyfileobj(file, aside)
        aside.seek(0)
        return aside
    except OSError as error:
        raise _unread(path, error) from error


def _aside() -> BinaryIO:
    """Temporary file, in memory while it is small, so that only large ones need a folder."""
    import tempfile  # slow import, needed for streams and pipes only

    return cast(BinaryIO, tempfile.SpooledTemporaryFile(max_size=1 << 24))


def display_name(path: str | Path) -> str:
    """Name of an input for messages, on one line."""
    return "<stdin>" if str(path) == STANDARD else str(path).replace("\n", "\\n")


def write_all(outputs: Mapping[str, bytes] | Mapping[Path, bytes], *, inputs: Sequence[str | Path] = ()) -> None:
    """Write every output or none: whole files are written next to their targets first and then moved into place.

    A target keeps its permissions; links are followed; the data are on the disk when this returns. Standard output ("-"),
    pipes and character devices are written to after the files.

    Raises:
        FileError: CC502, an output is an input of the command or another output; CC501, it cannot be written.
    """
    contents = {str(path): data for path, data in outputs.items()}
    with writing(list(contents), inputs=inputs) as files:
        for path, data in contents.items():
            files[path].write(data)


@contextmanager
def writing(
    paths: Sequence[str], *, inputs: Sequence[str | Path] = (), keep: bool = True
) -> Iterator[dict[str, BinaryIO]]:
    """Open files to be written in parts; all of them replace `paths` when the block succeeds, otherwise none.

    keep: False discards them. Raises FileError as write_all.
    """
    sources = [source_places(str(each)) for each in inputs]
    one_place_each(paths, *sources, *(each.places for each in _reading[-1:]))
    files: dict[str, BinaryIO] = {}
    replacements: list[Replacement] = []
    with ExitStack() as opened:
        for path in paths:
            if reason := unusable(path):
                raise FileError("CC501", f"cannot write {path}: {reason}")
            if stream_at(path) is not None:
                files[path] = opened.enter_context(_aside())
            else:
                with _naming(path):
                    replacement = opened.enter_context(Replacement(path))
                replacements.append(replacement)
                files[path] = replacement.file
        yield files
        if not keep:
            return
        for each in replacements:
            with _naming(each.name):
                each.finish()
        for each in replacements:
            with _naming(each.name):
                each.move()
        for path in paths:
            if (stream := stream_at(path)) is not None:
                _pour(files[path], path, stream)


@contextmanager
def _naming(path: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise FileError("CC501", f"cannot write {path}: {error.strerror}") from error


def _pour(file: BinaryIO, path: str, stream: str | int) -> None:
    """Copy a temporary file into a stream; a closed reader is no error."""
    file.seek(0)
    try:
        if path == STANDARD:
            shutil.copyfileobj(file, sys.stdout.buffer)
            sys.stdout.buffer.flush()
        else:
            handle = os.dup(stream) if isinstance(stream, int) else os.open(stream, os.O_WRONLY)
            with os.fdopen(handle, "wb") as sink:
                shutil.copyfileobj(file, sink)
    except BrokenPipeError:
        raise
    except OSError as error:
        name = "standard output" if path == STANDARD else path
        raise FileError("CC501", f"cannot write {name}: {error.strerror}") from error


@contextmanager
def alone_in(folder: Path, lock: Path) -> Iterator[None]:
    """Context with exclusive use of `folder`; the system releases the lock of a dead process. `lock`: a file for it.

    Raises:
        FileError: CC504, another process uses the folder; CC501, the lock cannot be written.
    """
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(lock, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError as error:
        raise FileError("CC501", f"cannot write {lock}: {error.strerror}") from error
    with os.fdopen(handle, "r+b") as file:
        try:
            _lock(file.fileno())
        except OSError as error:
            if error.errno not in (errno.EACCES, errno.EAGAIN, errno.EDEADLK):
                raise FileError("CC501", f"cannot lock {lock}: {error.strerror}") from error
            raise FileError("CC504", f"another process is writing to {folder}") from error
        yield


def _lock(handle: int) -> None:
    """Lock an open file until the process ends."""
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


def shipped(name: str) -> Path:
    """Path of a file of `config/`, `samples/` or `docs/`, in a checkout and in an installed camcomp. Raises FileError CC500."""
    package = Path(__file__).parent.parent
    for root in (package / "data", package.parent):
        if (root / name).exists():
            return root / name
    raise FileError("CC500", f"camcomp does not ship {name}")
