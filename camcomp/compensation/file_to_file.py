"""A program from file to files: corrected in pieces where it is long enough for that, otherwise as a whole."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, BinaryIO

from camcomp.compensation.program.result import Summary, interpolation_failed
from camcomp.compensation.report.tables import JointTable, joint_bytes
from camcomp.gcode.stamp import is_stamped
from camcomp.ground.errors import CheckFailed, ProgramError
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
class FileOutcome:
    """Figures of a corrected program, its failed checks (rule id and text), and the size of every output by name."""

    figures: Summary
    failed: list[tuple[str, str]]
    sizes: dict[str, int]


@dataclass(frozen=True, kw_only=True)
class CorrectionSettings:
    """Settings of a correction. arcs: whether arcs stay arcs; None: as the machine file says."""

    method: str
    tolerance_um: float
    version: str
    arcs: bool | None = None


def is_for_pieces(source: BinaryIO, job: Job, settings: CorrectionSettings) -> bool:
    """Whether a seekable program is long enough, and machine and method are such, that it is corrected in pieces."""
    size = source.seek(0, 2)
    source.seek(0)
    if size < LONG or settings.method != "newton" or len(job.machine.actuators) != 3:
        return False
    # masses look ahead, and what effects do has to depend on the piece and the time before it alone
    simple = not job.config.uncertain and not has_moved_mass(job.real_machine.robot)
    return not job.causes or (simple and not has_memory(job.causes))


@dataclass(frozen=True)
class OpenOutputs:
    """Files for a corrected program and its joint table; None omits one. table: name of the joint table."""

    program: BinaryIO | None
    joints: BinaryIO | None
    table: str | None

    def clear(self) -> None:
        """Empty the files."""
        for file in filter(None, (self.program, self.joints)):
            file.seek(0)
            file.truncate()


def compensate_into(
    source: BinaryIO, name: str, job: Job, settings: CorrectionSettings, outputs: OpenOutputs
) -> Totals:
    """Correct a seekable program at its start. name: that of messages.

    A program with a mistake is left to the reader of whole programs, which finds all of them; one of up to MOST_EXACT bytes
    whose interpolation fails its check is left to the exact way. Raises CheckFailed CC603
    for a program that was compensated before, and the errors of physics and files.
    """
    totals = _in_pieces(source, name, job, settings, outputs) if is_for_pieces(source, job, settings) else None
    if totals is not None:
        return totals
    from camcomp.compensation.long.answers import compensate_whole
    from camcomp.compensation.program.totals import Totals
    from camcomp.model.control import program_of

    outputs.clear()
    source.seek(0)
    data = source.read()
    if is_stamped(data):
        raise CheckFailed("CC603", f"{name} was compensated before")
    result = compensate_whole(program_of(data, name, job.config), job, **vars(settings))
    totals = Totals.of(result, job)
    if outputs.program is not None:
        outputs.program.write(result.written.data)
    if outputs.joints is not None and outputs.table is not None:
        outputs.joints.write(joint_bytes(result, job, outputs.table))
    return totals


def _in_pieces(
    source: BinaryIO, name: str, job: Job, settings: CorrectionSettings, outputs: OpenOutputs
) -> Totals | None:
    """`compensate_into` for a long program; None if it has to be corrected as a whole."""
    from camcomp.compensation.long.program import LongProgram
    from camcomp.compensation.long.runs import NotInPieces
    from camcomp.model.control import setup_of

    table = None
    try:
        if outputs.joints is not None and outputs.table is not None:
            table = JointTable(outputs.joints, outputs.table, job)
        pieces = LongProgram(
            job=job, name=name, setup=setup_of(job.config), tolerance_um=settings.tolerance_um,
            version=settings.version, arcs=settings.arcs, on_rows=None if table is None else table.add,
        )  # fmt: skip
        totals = pieces.run(source, len if outputs.program is None else outputs.program.write)
    except (NotInPieces, ProgramError) as error:
        if isinstance(error, ProgramError) and error.rule == "CC142":
            raise  # only the stock raises it, and the other reader would raise it again
        return None
    finally:
        if table is not None:
            table.close()
    failed = interpolation_failed(totals.interpolated) and source.seek(0, 2) <= MOST_EXACT
    return None if failed else totals


def compensate_to_files(
    source: BinaryIO, name: str, job: Job, settings: CorrectionSettings, *, program: str | None, joints: str | None,
    summary: str | None, inputs: Sequence[str], dry_run: bool,
) -> FileOutcome:  # fmt: skip
    """`compensate_into` named files: all of them are written, or none is. "-" is standard output, None omits an output."""
    names = [each for each in (program, joints, summary) if each is not None]
    with writing(names, inputs=inputs, keep=not dry_run) as files:
        text, rows = (files[each] if each else None for each in (program, joints))
        totals = compensate_into(source, name, job, settings, OpenOutputs(text, rows, table=joints))
        figures = totals.summary()
        if summary:
            files[summary].write(figures.to_json())
        return FileOutcome(
            figures, totals.failed_checks(settings.tolerance_um), {each: files[each].tell() for each in names}
        )
