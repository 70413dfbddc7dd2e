"""Diagnosis of the differences between a machine and its model: result of an experiment file, report, machine file."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from camcomp.api.result_table import ResultTable
from camcomp.diagnosis.result.types import DiagnosisResult
from camcomp.ground.errors import CheckFailed
from camcomp.ground.files import read_bytes
from camcomp.ground.places import STANDARD
from camcomp.ground.progress import part
from camcomp.model.config.linuxcnc_ini import SUFFIX as INI_SUFFIX
from camcomp.model.config.load import ExperimentFile, read_experiment
from camcomp.model.config.write_back import carried, machine_file, with_causes
from camcomp.report.page import Listing

if TYPE_CHECKING:
    from camcomp.diagnosis.diagnose import Diagnosis
    from camcomp.diagnosis.experiment.open_experiment import OpenExperiment
    from camcomp.diagnosis.law.library import LearnedLaw


MOST_LISTED = 200_000  # characters: largest file of a next experiment on the page


@dataclass(frozen=True, eq=False, kw_only=True)
class ExperimentDiagnosis:
    """The diagnosis of an experiment file. file: it and its machine; result: as `diagnose --json` writes it.

    behind, opened: the fit and the opened experiment; None for logs without programs (poses of arms, axes).
    """

    file: ExperimentFile
    result: DiagnosisResult
    behind: Diagnosis | None
    opened: OpenExperiment | None
    _residuals: Callable[[], dict[str, Any]]
    _learned: tuple[LearnedLaw, ...] = ()
    _notes: tuple[str, ...] = ()

    @property
    def experiment(self) -> str:
        """Path of the experiment file."""
        return self.file.path

    @property
    def verdict(self) -> str:
        """`none`, `identified`, `ambiguous` or `unknown`."""
        return self.result.verdict

    @cached_property
    def residuals(self) -> ResultTable:
        """Measured minus modelled at every row, before (`gap_...`) and with the causes (`rest_...`), by column of the log."""
        return ResultTable(self._residuals())

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the logs."""
        return self._notes if self.opened is None else self.opened.notes

    @property
    def configs(self) -> list[str]:
        """Machine files of the experiment."""
        return self.file.experiment.config

    @property
    def answer(self) -> list[str]:
        """The result in sentences, as the terminal shows it."""
        from camcomp.diagnosis.report.answer import answer_lines

        return answer_lines(self.result)

    def report(self) -> bytes:
        """One HTML page with plots. Raises ConfigError CC216 without the plot library."""
        from camcomp.diagnosis.report.views import report_of

        return report_of(
            file=self.file,
            result=self.result,
            done=self.behind,
            opened=self.opened,
            next_program=self._next_listing(),
        )

    def _next_listing(self) -> Listing | None:
        """The file of the next experiment for the page; None if there is no proposal or it exceeds MOST_LISTED."""
        proposal = self.result.next_experiment
        if proposal is None:
            return None
        name = "next-experiment.nc" if proposal.poses is None and proposal.moves is None else "next-experiment.csv"
        try:
            text = self.next_program(name)
        except CheckFailed:
            return None
        return Listing(name, text) if len(text) <= MOST_LISTED else None

    def machine_with_causes(self, target: str = STANDARD) -> str:
        """Text of the machine file with the causes, for a file called `target`."""
        actuators = tuple(self.file.config.robot.actuators)
        return machine_with_causes(self.configs, self.result, target, actuators=actuators, learned=self._learned)

    @property
    def next_program_cuts(self) -> bool:
        """Whether the proposed program cuts."""
        proposal = None if self.behind is None else self.behind.proposal
        return proposal is not None and proposal.candidate.cutting

    def next_program(self, target: str = "") -> str:
        """NC program of the proposed next experiment, for a file called `target`; of an arm its poses (.json, else CSV), of an axis
        its set-points (CSV).

        Raises CheckFailed CC608 without a proposal.
        """
        proposal = self.result.next_experiment
        if proposal is not None and proposal.poses is not None:
            from camcomp.diagnosis.arm.next_poses import pose_list
            from camcomp.model.statics.build import build_robot

            config = self.file.config
            robot, _ = build_robot(config.robot, config.tool.tip)
            return pose_list(proposal.poses, tuple(a.revolute for a in robot.actuators), target)
        if proposal is not None and proposal.moves is not None:
            from camcomp.diagnosis.axis.next_moves import stroke_table

            return stroke_table(proposal.moves)
        if proposal is None:
            raise CheckFailed("CC608", why_none(self.result.verdict, logs_only=self.behind is None))
        return next_program(self.behind, self.opened)


def diagnose(
    experiment: str | Path, without: Sequence[str] = (), library: str | Path | None = None
) -> ExperimentDiagnosis:
    """Diagnose why the machine of an experiment file differs from its model.

    Args:
        experiment: the experiment file.
        without: effects that are no candidates.
        library: folder of laws found before, which are candidates too; a new law is added to it.

    Raises:
        ConfigError, ProgramError, FileError: an input cannot be used.
        PhysicsError: a pose of the machine is impossible.
    """
    from threadpoolctl import threadpool_limits

    # threads of numpy slow small matrices down; in a user's process they are limited here, because numpy is loaded already
    stated = os.environ.get("OPENBLAS_NUM_THREADS", "")
    with threadpool_limits(limits=max(int(stated), 1) if stated.isdecimal() else 1, user_api="blas"):
        return _diagnosed(experiment, without, library)


def _diagnosed(experiment: str | Path, without: Sequence[str], library: str | Path | None) -> ExperimentDiagnosis:
    from camcomp.diagnosis.law.library import keep, learned

    file, study = read_experiment(experiment), None
    if all(run.program is None for run in file.experiment.runs):  # slow import
        from camcomp.diagnosis.studies import study_of

        study = study_of(file, without)
    if study is not None:
        if library is not None and study.result.law is not None and study.result.law.parts:
            keep(str(library), study.result.law, file.config.robot.name)
        return ExperimentDiagnosis(
            file=file,
            result=study.result,
            behind=None,
            opened=None,
            _residuals=study.residuals,
            _notes=study.notes,
        )
    from camcomp.diagnosis.diagnose import diagnose as judge
    from camcomp.diagnosis.experiment.open_experiment import open_experiment
    from camcomp.diagnosis.residuals import of_runs

    with part(0.0, 0.3):
        opened = open_experiment(file)
    sd = opened.experiment.sd
    known = [] if library is None else learned(str(library))
    with part(0.3, 1.0):
        done = judge(
            opened.job, opened.twin, opened.runs, holdout=opened.experiment.holdout, without=without,
            stated_mm=None if sd is None else sd.tip_mm, learned=known,
        )  # fmt: skip
    if library is not None and done.result.law is not None:
        keep(str(library), done.result.law, opened.job.config.robot.name)
    return ExperimentDiagnosis(
        file=file,
        result=done.result,
        behind=done,
        opened=opened,
        _residuals=lambda: of_runs(done, opened.twin, opened.runs),
        _learned=tuple(known),
    )


def machine_with_causes(
    configs: Sequence[str], result: DiagnosisResult, target: str, *, actuators: Sequence[str],
    learned: Sequence[LearnedLaw] = (),
) -> str:  # fmt: skip
    """Text of the machine file of `configs` with the causes, for a file called `target`; learned: laws by name."""
    before = {each.name: each for each in learned}
    parts = [*result.axis_laws, *(() if result.law is None else result.law.parts)]
    laws = [each.model_dump(exclude_none=True) for each in parts]
    for cause in result.known:
        if cause.effect in before:
            laws += before[cause.effect].entries({name: each.value for name, each in cause.parameters.items()})
    configs = [each for each in configs if Path(each).suffix.lower() != INI_SUFFIX]
    texts = [read_bytes(each).decode("utf-8-sig") for each in configs]
    k = machine_file(texts)
    texts[k] = carried(texts[k], texts[:k], result.known)
    note = f"found by camcomp diagnose, verdict {result.verdict}"
    if result.verdict == "ambiguous":
        note += f": the likeliest of {len(result.alternatives)} sets that explain the data equally well"
    to = Path.cwd() if target == STANDARD else Path(target).absolute().parent
    return with_causes(
        texts[k], [each for each in result.known if each.effect not in before], folder=str(Path(configs[k]).absolute().parent), moved_to=str(to), note=note,
        laws=laws, actuators=tuple(actuators),
    )  # fmt: skip


def why_none(verdict: str, *, logs_only: bool = False) -> str:
    """Reason for a diagnosis without a proposed experiment; logs_only: a diagnosis of logs without programs."""
    if verdict == "none":
        return "machine and model agree as far as these runs can tell, so no next experiment is proposed"
    if verdict == "identified":
        return "nothing is left to separate, and what stays uncertain of the causes is below the noise: no next experiment is proposed"
    if logs_only:
        return "no pose or stroke that the logs show would tell more, so no next experiment is proposed"
    return "no motion that this machine can do would separate what is left, so no next experiment is proposed"


def next_program(done: Any, opened: Any) -> str:
    """Text of the proposed program of a diagnosis. Raises CheckFailed CC608 without a proposal."""
    if done is None or opened is None or done.proposal is None:
        raise CheckFailed("CC608", "what is proposed is no motion of the machine: next_experiment says what to measure")
    from camcomp.diagnosis.next_experiment.ready_program import dialect_of_runs, ready_program

    dialect = dialect_of_runs(opened.experiment, opened.job)
    return ready_program(done.proposal.candidate, opened.runs, opened.job, opened.twin, dialect)
