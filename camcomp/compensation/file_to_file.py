"""Programs that are corrected in pieces, and the outputs that the pieces go to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, BinaryIO

from camcomp.compensation.program.result import Summary, interpolation_failed
from camcomp.compensation.report.tables import JointTable
from camcomp.ground.errors import ProgramError
from camcomp.ground.files import writing
from camcomp.ground.records import dataclass
from camcomp.model.job import Job
from camcomp.model.signal_path import has_memory
from camcomp.model.statics.masses import has_moved_mass

if TYPE_CHECKING:
    from camcomp.compensation.program.totals import Totals

LONG = 1 << 14  # bytes from which it pays to interpolate: some 500 lines
MOST_EXACT = 1 << 20  # bytes up to which a program is solved point by point where its interpolation is not good enough


@dataclass(frozen=True)
class OutputPaths:
    """Names of the outputs; "-" is standard output, None omits the output."""

    program: str | None
    joints: str | None
    summary: str | None

    def names(self) -> list[str]:
        """Names of the outputs that are written."""
        return [each for each in (self.program, self.joints, self.summary) if each is not None]


@dataclass(frozen=True)
class FileOutcome:
    """Figures of a corrected program, its failed checks (rule id and text), and the size of every output by name."""

    figures: Summary
    failed: list[tuple[str, str]]
    sizes: dict[str, int]


@dataclass(frozen=True, kw_only=True)
class CorrectionSettings:
    """Settings of a correction in pieces. arcs: whether arcs stay arcs; None: as the machine file says."""

    method: str
    tolerance_um: float
    version: str
    arcs: bool | None = None


def is_for_pieces(source: BinaryIO, job: Job, settings: CorrectionSettings) -> bool:
    """Whether a seekable program is long enough, and machine and method are such, that it is corrected in pieces."""
    size = source.seek(0, 2)
    source.seek(0)
    return size >= LONG and settings.method == "newton" and len(job.machine.actuators) == 3 and _goes_in_pieces(job)


def _goes_in_pieces(job: Job) -> bool:
    """Whether what effects do at a point depends on the piece of the program alone, and on the time before it."""
    if not job.causes:
        return True
    simple = not job.config.uncertain and not has_moved_mass(job.real_machine.robot)  # masses look ahead
    return simple and not has_memory(job.causes)


def compensate_in_pieces(
    source: BinaryIO, name: str, job: Job, settings: CorrectionSettings, program: Callable[[bytes], object],
    joints: Callable[[], JointTable] | None,
) -> Totals | None:  # fmt: skip
    """Correct a program of at least LONG bytes in pieces; None if it has to be corrected as a whole.

    source: the program, seekable, at its start and left there on None. name: that of messages. program: receives the
    corrected program in order; on None what it received is void. joints: opens the joint table.

    A program with a mistake is left to the reader of whole programs, which finds all of them; one of up to MOST_EXACT bytes
    whose interpolation fails its check is left to the exact way. Raises CheckFailed CC603
    for a program that was compensated before, and the errors of physics and files.
    """
    if not is_for_pieces(source, job, settings):
        return None
    from camcomp.compensation.long.linear_run import NotInPieces
    from camcomp.compensation.long.program import LongProgram
    from camcomp.model.control import setup_of

    try:
        table = joints() if joints is not None else None
        pieces = LongProgram(
            job=job, name=name, setup=setup_of(job.config), tolerance_um=settings.tolerance_um,
            version=settings.version, arcs=settings.arcs, on_rows=None if table is None else table.add,
        )  # fmt: skip
        totals = pieces.run(source, program)
        if table is not None:
            table.close()
    except (NotInPieces, ProgramError) as error:
        if isinstance(error, ProgramError) and error.rule == "CC142":
            raise  # only the stock raises it, and the other reader would raise it again
        source.seek(0)
        return None
    failed = interpolation_failed(totals.interpolated) and source.seek(0, 2) <= MOST_EXACT
    source.seek(0)
    return None if failed else totals


def compensate_long(
    source: BinaryIO, name: str, job: Job, settings: CorrectionSettings, *, paths: OutputPaths, inputs: Sequence[str], dry_run: bool
) -> FileOutcome | None:  # fmt: skip
    """Correct a program of at least LONG bytes in pieces, from file to files; arguments and errors as above."""
    if not is_for_pieces(source, job, settings):
        return None
    names = paths.names()
    with suppress(_AsAWhole), writing(names, inputs=inputs, keep=not dry_run) as files:
        joints = None if paths.joints is None else partial(JointTable, files[paths.joints], paths.joints, job)
        totals = compensate_in_pieces(
            source=source, name=name, job=job, settings=settings,
            program=files[paths.program].write if paths.program else len, joints=joints,
        )  # fmt: skip
        if totals is None:
            raise _AsAWhole  # files of an interrupted block are not kept
        figures = totals.summary()
        if paths.summary:
            files[paths.summary].write(figures.to_json())
        return FileOutcome(
            figures, totals.failed_checks(settings.tolerance_um), {each: files[each].tell() for each in names}
        )
    return None


class _AsAWhole(Exception):
    """The program has to be corrected as a whole."""
