"""The only disk access: bytes in, bytes out, `-` for the standard streams, several outputs all or none."""

import os
import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, cast

from camcomp.ground.errors import FileError

STANDARD = "-"


def read_bytes(path: str | Path) -> bytes:
    """Content of a file, or of standard input for "-". Raises FileError CC500."""
    if str(path) == STANDARD:
        return sys.stdin.buffer.read()
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise _unread(path, error) from error


def _unread(path: str | Path, error: OSError) -> FileError:
    """What a user needs to put it right: a folder holds the file meant, and a mistyped name has a neighbour."""
    from difflib import get_close_matches  # only a failure needs it

    wanted, hint = Path(path), None
    if isinstance(error, IsADirectoryError):
        hint = "this is a folder: name a file in it"
    elif isinstance(error, FileNotFoundError) and wanted.parent.is_dir():
        close = get_close_matches(wanted.name, sorted(each.name for each in wanted.parent.iterdir()), n=1)
        hint = f"did you mean {wanted.parent / close[0]}?" if close else None
    return FileError("CC500", f"cannot read {path}: {error.strerror}", hint=hint)


def open_source(path: str | Path) -> BinaryIO:
    """A file to be read from the begin as often as wanted; standard input is put aside on disk. Raises FileError CC500."""
    if str(path) == STANDARD:
        aside = cast(BinaryIO, tempfile.TemporaryFile())  # noqa: SIM115 - the caller closes it
        shutil.copyfileobj(sys.stdin.buffer, aside)
        aside.seek(0)
        return aside
    try:
        return Path(path).open("rb")
    except OSError as error:
        raise _unread(path, error) from error


def display_name(path: str | Path) -> str:
    """Name of an input for messages."""
    return "<stdin>" if str(path) == STANDARD else str(path)


def write_all(outputs: Mapping[str, bytes] | Mapping[Path, bytes], *, inputs: Sequence[str | Path] = ()) -> None:
    """Write every output or none: whole files are made beside their targets first and then moved into place.

    A target keeps its permissions; a link is followed. "-" goes to standard output, after the files. Raises FileError:
    CC502 when an output is one of `inputs`, CC501 when one cannot be written.
    """
    contents = {str(path): data for path, data in outputs.items()}
    targets = {path: Path(path).resolve() for path in contents if path != STANDARD}
    _refuse_clashes(targets, inputs)
    made: list[tuple[str, Path]] = []
    try:
        for path, target in targets.items():
            made.append((_write_beside(target, contents[path]), target))
        while made:
            os.replace(*made[0])
            made.pop(0)
    except OSError as error:
        raise FileError("CC501", f"cannot write {error.filename2 or error.filename}: {error.strerror}") from error
    finally:
        for temporary, _ in made:
            os.unlink(temporary)
    if STANDARD in contents:
        sys.stdout.buffer.write(contents[STANDARD])
        sys.stdout.buffer.flush()


def _refuse_clashes(targets: Mapping[str, Path], inputs: Sequence[str | Path]) -> None:
    sources = [Path(path) for path in inputs if str(path) != STANDARD]
    for path, target in targets.items():
        for source in sources:
            if target == source.resolve() or (target.exists() and source.exists() and target.samefile(source)):
                raise FileError("CC502", f"{path} is an input and would be overwritten")
    if len(set(targets.values())) < len(targets):
        names = ", ".join(targets)
        raise FileError("CC502", f"two outputs go to the same file: {names}", hint="give each output its own name")


def _write_beside(target: Path, data: bytes) -> str:
    file, temporary = _open_beside(target)
    try:
        with file:
            file.write(data)
    except BaseException:
        os.unlink(temporary)
        raise
    return temporary


def _open_beside(target: Path) -> tuple[BinaryIO, str]:
    if target.is_dir():
        raise IsADirectoryError(21, "is a directory", str(target))
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    except OSError as error:  # name the file asked for, not the temporary one
        raise OSError(error.errno, error.strerror, str(target)) from error
    try:
        os.chmod(temporary, target.stat().st_mode & 0o7777 if target.exists() else 0o666 & ~_umask())
        return os.fdopen(handle, "w+b"), temporary
    except BaseException:
        os.unlink(temporary)
        raise


@contextmanager
def writing(
    paths: Sequence[str], *, inputs: Sequence[str | Path] = (), keep: bool = True
) -> Iterator[dict[str, BinaryIO]]:
    """Open files to be filled bit by bit; they take the place of `paths` when the block ends well, or none of them does.

    "-" goes to standard output at the end. keep: false writes nothing in the end. Raises FileError as write_all does.
    """
    targets = {path: Path(path).resolve() for path in paths if path != STANDARD}
    _refuse_clashes(targets, inputs)
    files: dict[str, BinaryIO] = {}
    made: list[tuple[str, Path]] = []
    try:
        for path, target in targets.items():
            files[path], temporary = _open_beside(target)
            made.append((temporary, target))
        if STANDARD in paths:
            files[STANDARD] = cast(BinaryIO, tempfile.TemporaryFile())  # noqa: SIM115 - closed below
        yield files
        for path in targets:
            files[path].close()
        while made and keep:
            os.replace(*made[0])
            made.pop(0)
        if STANDARD in files and keep:
            files[STANDARD].seek(0)
            shutil.copyfileobj(files[STANDARD], sys.stdout.buffer)
            sys.stdout.buffer.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        raise FileError("CC501", f"cannot write {error.filename2 or error.filename}: {error.strerror}") from error
    finally:
        for file in files.values():
            file.close()
        for temporary, _ in made:
            os.unlink(temporary)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def shipped(name: str) -> Path:
    """Path of a file of `config/` or `samples/`, in a checkout as in an installed camcomp. Raises FileError CC500."""
    package = Path(__file__).parent.parent
    for root in (package / "data", package.parent):
        if (root / name).exists():
            return root / name
    raise FileError("CC500", f"camcomp does not ship {name}")
