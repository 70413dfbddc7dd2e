"""Long programs from file to files: which ones are corrected piece by piece, and where the pieces go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import BinaryIO

from camcomp.compensation.program.result import Summary
from camcomp.compensation.report.joint_table import joint_table
from camcomp.ground.errors import ProgramError
from camcomp.ground.files import writing
from camcomp.model.job import Job

LONG = 1 << 16  # bytes from which it pays to interpolate: some 2 000 lines


@dataclass(frozen=True)
class Wanted:
    """Names of the outputs, "-" is standard output; none of them may be None at once."""

    program: str | None
    joints: str | None
    summary: str | None

    def names(self) -> list[str]:
        """Those that are wanted."""
        return [each for each in (self.program, self.joints, self.summary) if each is not None]


@dataclass(frozen=True)
class Finished:
    """What became of a long program: its figures, the checks it failed, and the size of every output."""

    figures: Summary
    failed: list[tuple[str, str]]
    sizes: dict[str, int]


def compensate_long(
    source: BinaryIO, name: str, job: Job, *, method: str, tolerance_um: float, version: str, wanted: Wanted, inputs: Sequence[str],
    dry_run: bool, arcs: bool | None = None,
) -> Finished | None:  # fmt: skip
    """Corrects a program of at least LONG bytes piece by piece; None when it has to be corrected as a whole.

    source: the program, seekable, at its begin and left there on None. name: in messages. A program with a mistake is
    left to the reader of whole programs too, which finds all of them. Raises CheckFailed CC603 when it was corrected
    before, and what physics and files raise.
    """
    if method != "newton" or job.causes or len(job.machine.actuators) != 3:
        return None
    size = source.seek(0, 2)
    source.seek(0)
    if size < LONG:
        return None
    from camcomp.compensation.long.plain_run import NotInPieces
    from camcomp.compensation.long.program import Bulk
    from camcomp.model.control import setup_of

    names = wanted.names()
    try:
        with writing(names, inputs=inputs, keep=not dry_run) as files:
            table = joint_table(files[wanted.joints], wanted.joints, job) if wanted.joints else None
            bulk = Bulk(
                job, name, setup_of(job.config), tolerance_um, version, arcs, None if table is None else table.batch
            )
            totals = bulk.run(source, files[wanted.program].write if wanted.program else len)
            if table is not None:
                table.close()
            figures = totals.summary()
            if wanted.summary:
                files[wanted.summary].write(figures.to_json())
            sizes = {name: files[name].tell() for name in names}
    except (NotInPieces, ProgramError) as error:
        if isinstance(error, ProgramError) and error.rule == "CC142":
            raise  # what the stock says needs no other reader
        source.seek(0)
        return None
    return Finished(figures, totals.failed_checks(tolerance_um), sizes)
