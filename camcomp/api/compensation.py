"""Compensation of programs: in memory, or from file to files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from camcomp import __version__
from camcomp.api.machine import Job, Program, load_machine, program_in
from camcomp.api.result_table import ResultTable
from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.program.result import Summary
from camcomp.compensation.program.totals import Totals
from camcomp.compensation.report import tables
from camcomp.compensation.report.tables import joint_bytes
from camcomp.gcode.stamp import is_stamped
from camcomp.ground.errors import CheckFailed
from camcomp.ground.files import display_name, open_source, read_bytes, write_all
from camcomp.ground.places import STANDARD
from camcomp.model.from_program import StockChoice, job_of_program

__all__ = ["CompensatedProgram", "Summary", "compensate", "compensate_file"]

if TYPE_CHECKING:
    from camcomp.compensation.file_to_file import FileOutcome
    from camcomp.report.inputs import Input


@dataclass(frozen=True, eq=False)
class CompensatedProgram:
    """A corrected program and its figures. outcome: all quantities as arrays."""

    outcome: Compensated
    machine: Job
    tolerance_um: float

    @property
    def data(self) -> bytes:
        """The corrected program as bytes."""
        return self.outcome.written.data

    @property
    def text(self) -> str:
        """The corrected program as text."""
        return self.data.decode("utf-8", "surrogateescape")

    @cached_property
    def _totals(self) -> Totals:
        return Totals.of(self.outcome, self.machine)

    @cached_property
    def summary(self) -> Summary:
        """The figures of `compensate --summary`."""
        return self._totals.summary()

    @cached_property
    def joints(self) -> ResultTable:
        """Programmed and corrected tip, force, and every actuator, at every end point: `compensate --joints`."""
        return ResultTable.of_csv(self.joint_file("joints.csv"))

    @cached_property
    def paths(self) -> ResultTable:
        """The five trajectories of the tip: `compensate --paths`."""
        return ResultTable.of_csv(self.paths_file())

    @property
    def failed(self) -> list[tuple[str, str]]:
        """Rule id and text of every failed check; empty: the corrected program may run."""
        return self._totals.failed_checks(self.tolerance_um)

    def joint_file(self, name: str) -> bytes:
        """The joint table as the bytes of a file called `name`: CSV, or Parquet by its suffix."""
        return joint_bytes(self.outcome, self.machine, name)

    def paths_file(self) -> bytes:
        """The five trajectories as CSV."""
        return tables.paths_csv(self.outcome, self.machine)

    def report(self, inputs: Sequence[Input] = ()) -> bytes:
        """One HTML page with plots. Raises ConfigError CC216 without the plot library."""
        from camcomp.compensation.report.page import compensation_html

        return compensation_html(self.outcome, self._totals, self.tolerance_um, inputs)


def compensate(
    program: Program | str | Path | bytes, machine: Job, *, method: str | None = None, tolerance_um: float | None = None,
    arcs: bool | None = None, mirror: Sequence[str] = (), stock: StockChoice | None = None,
) -> CompensatedProgram:  # fmt: skip
    """Compensate the deflection of the machine in a program.

    Args:
        program: a program, its file, or its bytes.
        machine: of `load_machine`.
        method: of the correction; None: of the machine file.
        tolerance_um: largest tip error by the model; None: of the machine file.
        arcs: arcs come out as arcs; None: of the machine file.
        mirror: logs of test cuts, whose measured deviation is subtracted in place of the modelled one; each log belongs to
            the program that the logs before it correct.
        stock: source of the stock; None: the machine file, else the comments of the program.

    Returns:
        The corrected program with its figures.

    Raises:
        CheckFailed: CC603, the program was compensated before.
        PhysicsError: the machine cannot reach a commanded point.
        ConfigError, ProgramError, FileError: as from `load_machine` and `read_program`.
    """
    source, settings = program_in(program, machine), machine.config.compensation
    if is_stamped(source.data):
        raise CheckFailed("CC603", f"{source.name} was compensated before")
    tolerance = tolerance_um or settings.tolerance_um
    machine = job_of_program(machine, source.data, source.name, stock)
    if mirror:
        from camcomp.compensation.program.mirror import mirrored

        machine = mirrored(machine, source.path, mirror)
    from camcomp.compensation.long.answers import compensate_whole

    done = compensate_whole(
        source, machine, method=method or settings.method, tolerance_um=tolerance, version=__version__, arcs=arcs
    )
    return CompensatedProgram(done, machine, tolerance)


def compensate_file(
    program: str, configs: Sequence[str], *, output: str | None = None, joints: str | None = None, summary: str | None = None,
    paths: str | None = None, report: str | None = None, method: str | None = None, tolerance_um: float | None = None,
    arcs: bool | None = None, mirror: Sequence[str] = (), dry_run: bool = False, stock: StockChoice | None = None,
    if_compensated: Literal["refuse", "pass"] = "refuse",
) -> FileOutcome | None:  # fmt: skip
    """Compensate a program file into the named files, long programs in pieces; "-" is a standard stream.

    Without any name the corrected program goes to standard output. A program that was compensated before is refused, or with
    `if_compensated="pass"` copied unchanged to `output`; the result is then None.

    Returns:
        Figures and the size of every output by its name.

    Raises:
        FileError: an output cannot be written; and the errors of `compensate`.
    """
    from camcomp.compensation.file_to_file import CorrectionSettings, FileOutcome, compensate_to_files

    machine = load_machine(*configs)
    if report:
        from camcomp.report.page import plot_library

        plot_library()  # a missing library raises before the work
    if not (output or joints or summary or paths or report):
        output = STANDARD
    settings, name = machine.config.compensation, display_name(program)
    with open_source(program) as file:
        if if_compensated == "pass" and is_stamped(data := file.read()):
            if output and not dry_run:
                write_all({output: data}, inputs=(program, *configs, *mirror))
            return None
        file.seek(0)
        own = job_of_program(machine, file, name, stock)
        if not (paths or report or mirror):
            asked = CorrectionSettings(
                method=method or settings.method,
                tolerance_um=tolerance_um or settings.tolerance_um,
                version=__version__,
                arcs=arcs,
            )
            return compensate_to_files(
                file, name, own, asked, program=output, joints=joints, summary=summary, inputs=(program, *configs),
                dry_run=dry_run,
            )  # fmt: skip
        data = file.read()
    from camcomp.model.control import program_of

    result = compensate(
        program_of(data, name, machine.config), machine, method=method, tolerance_um=tolerance_um, arcs=arcs,
        mirror=mirror, stock=stock,
    )  # fmt: skip
    asked_for: list[tuple[str | None, Callable[[str], bytes]]] = [
        (output, lambda _: result.data), (joints, result.joint_file), (paths, lambda _: result.paths_file()),
        (summary, lambda _: result.summary.to_json()),
        (report, lambda _: result.report(_inputs(name, data, configs))),
    ]  # fmt: skip
    outputs = {each: make(each) for each, make in asked_for if each}
    failed = result.failed
    if not dry_run:
        write_all(outputs, inputs=(program, *configs, *mirror))
    return FileOutcome(result.summary, failed, {each: len(made) for each, made in outputs.items()})


def _inputs(name: str, data: bytes, configs: Sequence[str]) -> list[Input]:
    """The program and the machine files as inputs of a report, without standard input."""
    from camcomp.report.inputs import Input  # slow import, needed for a report only

    files = [Input("configuration", display_name(each), read_bytes(each)) for each in configs if each != STANDARD]
    return [Input("program", name, data), *files]
