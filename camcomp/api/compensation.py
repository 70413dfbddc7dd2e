"""Programs corrected: in memory for programs, from file to files for the command line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from camcomp import __version__
from camcomp.api.machine import Job, Program, load_machine, program_in
from camcomp.api.result_table import ResultTable
from camcomp.compensation.program import compensate as story
from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.program.result import Summary
from camcomp.compensation.report import tables
from camcomp.compensation.report.joint_table import joint_bytes
from camcomp.gcode.stamp import is_stamped
from camcomp.ground.errors import CheckFailed
from camcomp.ground.files import display_name, open_source, read_bytes, write_all
from camcomp.ground.places import STANDARD
from camcomp.model.from_program import StockChoice, job_of_program
from camcomp.report.inputs import Input

__all__ = ["CompensatedProgram", "Summary", "compensate", "compensate_file"]

if TYPE_CHECKING:
    from camcomp.compensation.file_to_file import Finished


@dataclass(frozen=True, eq=False)
class CompensatedProgram:
    """A corrected program and what is known about it. outcome: everything, as arrays."""

    outcome: Compensated
    machine: Job
    tolerance_um: float

    @property
    def data(self) -> bytes:
        """The corrected program, byte by byte."""
        return self.outcome.written.data

    @property
    def text(self) -> str:
        """The corrected program."""
        return self.data.decode("utf-8", "surrogateescape")

    @cached_property
    def summary(self) -> Summary:
        """The figures of `compensate --summary`."""
        return tables.summary(self.outcome, self.machine)

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
        """Rule id and text of every check that the corrected program does not pass; empty when it may run."""
        return self.outcome.failed_checks(self.machine, self.tolerance_um)

    def joint_file(self, name: str) -> bytes:
        """The joint table as the file called `name` holds it: CSV, or Parquet by its suffix."""
        return joint_bytes(self.outcome, self.machine, name)

    def paths_file(self) -> bytes:
        """The five trajectories as CSV."""
        return tables.paths_csv(self.outcome, story.trajectories(self.outcome, self.machine))

    def report(self, inputs: Sequence[Input] = ()) -> bytes:
        """One HTML page with plots. Raises ConfigError CC216 when the plot library is not installed."""
        from camcomp.compensation.report.page import compensation_html

        return compensation_html(
            self.outcome, self.machine, self.summary, failed=self.failed, tolerance_um=self.tolerance_um, inputs=inputs
        )


def compensate(
    program: Program | str | Path | bytes, machine: Job, *, method: str | None = None, tolerance_um: float | None = None,
    arcs: bool | None = None, mirror: Sequence[str] = (), stock: StockChoice | None = None,
) -> CompensatedProgram:  # fmt: skip
    """The program with the deflection of the machine written back into it.

    method, tolerance_um, arcs: None asks the machine file. stock: where the stock comes from; None: the machine file, or
    else the comments of the program. mirror: logs of test cuts, whose deviation is put in reverse on the
    program in place of what the model says; each is that of the program as the ones before corrected it. Raises CheckFailed CC603 for a program that was compensated
    before, PhysicsError where the machine cannot do what is asked, and what reading raises.
    """
    source, settings = program_in(program, machine), machine.config.compensation
    if is_stamped(source.data):
        raise CheckFailed("CC603", f"{source.name} was compensated before")
    tolerance = tolerance_um or settings.tolerance_um
    machine = job_of_program(machine, source.data, source.name, stock)
    if mirror:
        from camcomp.compensation.program.mirror import mirrored

        machine = mirrored(machine, source.path, mirror)
    done = story.compensate(
        source, machine, method=method or settings.method, tolerance_um=tolerance, version=__version__, arcs=arcs
    )
    return CompensatedProgram(done, machine, tolerance)


def compensate_file(
    program: str, configs: Sequence[str], *, output: str | None = None, joints: str | None = None, summary: str | None = None,
    paths: str | None = None, report: str | None = None, method: str | None = None, tolerance_um: float | None = None,
    arcs: bool | None = None, mirror: Sequence[str] = (), dry_run: bool = False, stock: StockChoice | None = None,
    if_compensated: Literal["refuse", "pass"] = "refuse",
) -> Finished | None:  # fmt: skip
    """Corrects a program file into the files that are named; long programs piece by piece. "-" is a standard stream.

    Without any name the corrected program goes to standard output. sizes: of every output, by its name. A program that
    was compensated before is refused, or with `if_compensated="pass"` goes to `output` as it is, and there is nothing
    to return. Raises what `compensate` raises, FileError where nothing can be written.
    """
    from camcomp.compensation.file_to_file import Finished, Wanted, compensate_long

    machine = load_machine(*configs)
    if report:
        from camcomp.report.page import plot_library

        plot_library()  # a missing library is told before the work, not after it
    if not (output or joints or summary or paths or report):
        output = STANDARD
    settings, name = machine.config.compensation, display_name(program)
    with open_source(program) as file:
        done = None
        if if_compensated == "pass" and is_stamped(data := file.read()):
            if output and not dry_run:
                write_all({output: data}, inputs=(program, *configs, *mirror))
            return None
        file.seek(0)
        machine = job_of_program(machine, file, name, stock)
        if not (paths or report or mirror):
            done = compensate_long(
                file, name, machine, method=method or settings.method, tolerance_um=tolerance_um or settings.tolerance_um,
                version=__version__, dry_run=dry_run, arcs=arcs, wanted=Wanted(output, joints, summary), inputs=(program, *configs),
            )  # fmt: skip
        if done is not None:
            return done
        data = file.read()
    from camcomp.model.control import program_of

    result = compensate(
        program_of(data, name, machine.config), machine, method=method, tolerance_um=tolerance_um, arcs=arcs,
        mirror=mirror, stock=stock,
    )  # fmt: skip
    outputs: dict[str, bytes] = {}
    if output:
        outputs[output] = result.data
    if joints:
        outputs[joints] = result.joint_file(joints)
    if paths:
        outputs[paths] = result.paths_file()
    if summary:
        outputs[summary] = result.summary.to_json()
    if report:
        inputs = [Input("program", name, data)]
        inputs += [Input("configuration", display_name(each), read_bytes(each)) for each in configs if each != STANDARD]
        outputs[report] = result.report(inputs)
    failed = result.failed
    if not dry_run:
        write_all(outputs, inputs=(program, *configs, *mirror))
    return Finished(result.summary, failed, {each: len(made) for each, made in outputs.items()})
