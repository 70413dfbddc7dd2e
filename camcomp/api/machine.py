"""A machine from its files, and programs as its controller reads them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from camcomp.gcode.canon import canonical
from camcomp.gcode.program import Program
from camcomp.model.config.load import load_config
from camcomp.model.control import open_program, program_of
from camcomp.model.from_program import StockChoice
from camcomp.model.job import Job

__all__ = ["Job", "Program", "StockChoice", "canonical_lines", "load_machine", "program_in", "read_program"]


def load_machine(*files: str | Path) -> Job:
    """Load a machine from YAML files; later files override earlier ones key by key.

    Its parts `.config`, `.machine`, `.frame` are computed on access. Raises ConfigError, FileError.
    """
    return Job(load_config(files))


def read_program(program: str | Path | bytes, machine: Job | None = None) -> Program:
    """Read an NC program from its file or its bytes as the controller of `machine` does, or with default settings.

    Its motions are the arrays of `.path` (mm, program frame of G54). Raises FileError, ProgramError.
    """
    config = machine.config if machine is not None else None
    if isinstance(program, bytes):
        return program_of(program, "<bytes>", config)
    return open_program(program, config)


def program_in(program: Program | str | Path | bytes, machine: Job) -> Program:
    """`program` itself if it is a Program, else the program read from its file or bytes."""
    return program if isinstance(program, Program) else read_program(program, machine)


def canonical_lines(program: Program) -> Iterable[str]:
    """Motions of a program as text, one line per motion."""
    return canonical(program.path)
