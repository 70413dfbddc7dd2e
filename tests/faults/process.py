"""camcomp in processes of its own, warm ones that fork in milliseconds, with something done to them."""

import ctypes
import errno
import io
import multiprocessing
import os
import resource
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from tests.commandline import ROOT

PATIENCE = 60.0  # s after which a process counts as hanging
_context = multiprocessing.get_context("forkserver")
_context.set_forkserver_preload(["tests.faults.warm"])


@dataclass(frozen=True)
class Fault:
    """What happens to a process. All of it is done inside, before camcomp starts."""

    full_at: int | None = None  # the step of writing, counted from 1, from which the disk is full
    file_bytes: int | None = None  # largest file that the system lets it write
    memory_bytes: int | None = None  # beyond what it has
    descriptors: int | None = None  # beyond the lowest that is free
    slow_s: float = 0.0  # every step of writing takes so long
    powerless: bool = False  # root, too, may only do what the permissions say


@dataclass(frozen=True)
class Ended:
    """How a process ended: exit code, or minus the signal; hit: a signal found it alive; hung: it had to be stopped."""

    code: int
    said: str
    hit: bool = False
    hung: bool = False


@dataclass
class Shot:
    """A signal to be sent after a time."""

    number: int
    after_s: float


def camcomp(words, folder, fault=None, shot=None, stdin=""):
    """Runs one command line in `folder`; its output is kept outside of the folder."""
    said = folder.with_name(folder.name + ".said")
    process = _context.Process(
        target=_child, args=([str(w) for w in words], str(folder), str(said), fault or Fault(), stdin)
    )
    process.start()
    hit = False
    if shot is not None:
        process.join(shot.after_s)
        if process.exitcode is None:
            os.kill(process.pid, shot.number)
            hit = True
    process.join(PATIENCE)
    hung = process.exitcode is None
    if hung:
        process.kill()
        process.join()
    text = said.read_text(errors="replace") if said.exists() else ""
    said.unlink(missing_ok=True)
    return Ended(process.exitcode, text, hit, hung)


def _child(words, folder, said, fault, stdin):
    os.setpgid(0, 0)
    os.chdir(folder)
    for number, path, flags in (
        (0, os.devnull, os.O_RDONLY),
        (1, os.devnull, os.O_WRONLY),
        (2, said, os.O_WRONLY | os.O_CREAT),
    ):
        handle = os.open(path, flags, 0o600)
        os.dup2(handle, number)
        os.close(handle)
    sys.stdin = io.TextIOWrapper(io.BytesIO(stdin.encode(errors="surrogateescape")))
    sys.stdout, sys.stderr = os.fdopen(1, "w", closefd=False), os.fdopen(2, "w", closefd=False)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    _prepare(fault)
    code = 0
    try:
        from camcomp.terminal import cli

        cli.main(words)
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    finally:
        sys.stderr.flush()
        os._exit(code)


def _prepare(fault):
    if fault.full_at is not None or fault.slow_s:
        _spoil_writing(fault)
    if fault.file_bytes is not None:
        _limit(resource.RLIMIT_FSIZE, fault.file_bytes)
    if fault.powerless:
        _obey_permissions()
    if fault.memory_bytes is not None:
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        _limit(resource.RLIMIT_AS, pages * resource.getpagesize() + fault.memory_bytes)
    if fault.descriptors is not None:
        free = os.open(os.devnull, os.O_RDONLY)
        os.close(free)
        _limit(resource.RLIMIT_NOFILE, free + fault.descriptors)


def _limit(what, size):
    resource.setrlimit(what, (size, resource.getrlimit(what)[1]))


def _spoil_writing(fault):
    """Each step of making a file waits, and from one step on fails."""
    from camcomp.ground import replacement

    count = 0

    def step(function):
        def spoilt(*words, **more):
            nonlocal count
            count += 1
            time.sleep(fault.slow_s)
            if fault.full_at is not None and count >= fault.full_at:
                raise OSError(errno.ENOSPC, "No space left on device")
            return function(*words, **more)

        return spoilt

    for name in ("fsync", "link", "replace", "fchmod", "mkdir"):
        setattr(os, name, step(getattr(os, name)))
    replacement.io = _Module(io, FileIO=type("FileIO", (io.FileIO,), {"write": step(io.FileIO.write)}))
    replacement._Named.write.__globals__["io"] = replacement.io
    replacement._Named.__bases__ = (replacement.io.FileIO,)


class _Module:
    def __init__(self, module, **others):
        self.__dict__.update(vars(module))
        self.__dict__.update(others)


class _Capabilities(ctypes.Structure):
    _fields_ = [("effective", ctypes.c_uint32), ("permitted", ctypes.c_uint32), ("inheritable", ctypes.c_uint32)]


class _Header(ctypes.Structure):
    _fields_ = [("version", ctypes.c_uint32), ("pid", ctypes.c_int)]


def _obey_permissions():
    """Takes from root the right to write and read whatever the permissions say (CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH)."""
    if os.geteuid() != 0:
        return
    libc = ctypes.CDLL(None, use_errno=True)
    header, sets = _Header(0x20080522, 0), (_Capabilities * 2)()
    libc.capget(ctypes.byref(header), sets)
    sets[0].effective &= ~0b110
    libc.capset(ctypes.byref(header), sets)


def environment(**more):
    """For processes that are started from the begin."""
    return {**os.environ, "PYTHONPATH": str(ROOT), **more}
