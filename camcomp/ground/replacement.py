"""Atomic replacement of a file by one that is completely written and synchronised to disk."""

import contextlib
import io
import os
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

from camcomp.ground.errors import FileError


class Replacement:
    """A new file for a target: write to `file`, `finish` synchronises it to disk, `move` replaces the target.

    On Linux the file has no name until it is moved, so that it vanishes if the process ends early. The target keeps its
    permissions, and its owner and group where the system permits that; links are followed. mode: permissions in place of
    those. Raises OSError.
    """

    def __init__(self, name: str, *, mode: int | None = None) -> None:
        self.name, self._mode = name, mode
        self._target = Path(os.path.realpath(name))
        self._aside = self._target.with_name(f".camcomp-{os.urandom(8).hex()}")
        self._named = False
        try:
            handle = self._open()
        except OSError as error:
            raise OSError(error.errno, error.strerror, name) from error
        self.file: BinaryIO = io.BufferedRandom(_Named(handle, name))

    def _open(self) -> int:
        if hasattr(os, "O_TMPFILE") and os.path.isdir("/proc/self/fd"):
            with contextlib.suppress(OSError):  # a file system without nameless files
                return os.open(self._target.parent, os.O_TMPFILE | os.O_RDWR | os.O_CLOEXEC, 0o600)
        self._named = True
        return os.open(self._aside, os.O_CREAT | os.O_EXCL | os.O_RDWR | getattr(os, "O_BINARY", 0), 0o600)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(FileError, OSError):  # the failed write has already raised
            self.file.close()
        if self._named:
            with contextlib.suppress(OSError):
                os.unlink(self._aside)

    def finish(self) -> None:
        """Synchronise the data to disk, with the permissions of the target or of a new file."""
        self.file.flush()
        handle = self.file.fileno()
        if hasattr(os, "fchmod"):
            os.fchmod(handle, self._permissions(handle) if self._mode is None else self._mode)
        os.fsync(handle)
        if self._named:
            self.file.close()  # some systems move no open files

    def _permissions(self, handle: int) -> int:
        """Permissions of the target without its set-user and set-group bits, which would grant rights of another owner.

        If the target's group cannot be kept, the new group gets the permissions of other users only.
        """
        try:
            before = self._target.stat()
        except OSError:
            return 0o666 & ~_umask()
        mode = before.st_mode & 0o777
        for owner, group in ((-1, before.st_gid), (before.st_uid, -1)):
            with contextlib.suppress(OSError):
                os.fchown(handle, owner, group)
        if os.fstat(handle).st_gid != before.st_gid:
            mode &= ~0o070 | (mode & 0o007) << 3
        return mode

    def move(self) -> None:
        """Rename the finished file to the target, durable after a loss of power."""
        if self._named:
            self._replace()
        else:
            try:
                self._link(self._target.name)
            except FileExistsError:
                self._named = True
                self._link(self._aside.name)
                self._replace()
        with contextlib.suppress(OSError):  # not every system opens folders, not every folder may be read
            folder = os.open(self._target.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)

    def _replace(self) -> None:
        os.replace(self._aside, self._target)
        self._named = False

    def _link(self, name: str) -> None:
        """Give the nameless file a name."""
        folder = os.open(self._target.parent, os.O_PATH)
        try:
            # With the descriptor of a folder Python follows links, and this link leads to the file.
            source = f"/proc/self/fd/{self.file.fileno()}"
            os.link(source, name, src_dir_fd=folder, dst_dir_fd=folder, follow_symlinks=True)
        finally:
            os.close(folder)


class _Named(io.FileIO):
    """A file whose errors name the output."""

    def __init__(self, handle: int, output: str) -> None:
        super().__init__(handle, "r+b")
        self._output = output

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except OSError as error:
            raise FileError("CC501", f"cannot write {self._output}: {error.strerror}") from error


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
