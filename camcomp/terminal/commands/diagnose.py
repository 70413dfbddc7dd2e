"""camcomp diagnose."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camcomp.ground.errors import CheckFailed
from camcomp.ground.files import read_bytes, write_all
from camcomp.ground.places import STANDARD
from camcomp.model.config.write_back import machine_file, with_causes
from camcomp.terminal.commands._options import OUTPUT, quiet_option
from camcomp.terminal.progress import say, working

if TYPE_CHECKING:
    from camcomp.diagnosis.diagnose import Diagnosis
    from camcomp.diagnosis.experiment.open_experiment import OpenExperiment
    from camcomp.diagnosis.result.types import DiagnosisResult


def examine(
    path: str | Path, without: Sequence[str] = ()
) -> "tuple[DiagnosisResult, Diagnosis | None, OpenExperiment | None]":
    """The result of an experiment file, and what it was drawn from; nothing of that for logs that have a study of their own.

    Raises CamcompError.
    """
    from camcomp.diagnosis.diagnose import diagnose
    from camcomp.diagnosis.experiment.open_experiment import open_experiment
    from camcomp.diagnosis.studies import study_of

    if (study := study_of(path, without)) is not None:
        return study, None, None
    opened = open_experiment(path)
    sd = opened.experiment.sd
    done = diagnose(
        opened.job, opened.twin, opened.runs, holdout=opened.experiment.holdout, without=without,
        stated_mm=None if sd is None else sd.tip_mm,
    )  # fmt: skip
    return done.result, done, opened


def _machine_with_causes(configs: Sequence[str], result: "DiagnosisResult", target: str) -> str:
    """Text of the machine file with the causes in it."""
    texts = [read_bytes(each).decode("utf-8-sig") for each in configs]
    k = machine_file(texts)
    note = f"found by camcomp diagnose, verdict {result.verdict}"
    if result.verdict == "ambiguous":
        note += f": the likeliest of {len(result.alternatives)} sets that explain the data alike"
    to = Path.cwd() if target == STANDARD else Path(target).absolute().parent
    return with_causes(
        texts[k], result.known, folder=str(Path(configs[k]).absolute().parent), moved_to=str(to), note=note
    )


def _next_program(done: Any, opened: Any) -> str:
    """Text of the proposed program. Raises CheckFailed CC608 where there is none."""
    if done is None or opened is None:
        raise CheckFailed("CC608", "experiments without programs get no program for the next one")
    if done.proposal is None:
        raise CheckFailed("CC608", "nothing is left to separate, so no next experiment is proposed")
    from camcomp.diagnosis.next_experiment.ready_program import ready_program

    text = ready_program(done.proposal.candidate, opened.runs, opened.job, opened.twin)
    if done.proposal.candidate.cutting:
        click.echo("warning: the proposed program cuts; look through it before it runs", err=True)
    return text


@click.command()
@click.argument("experiment")
@click.option("--json", "json_file", metavar="OUT.json", type=OUTPUT, help="The result; - is standard output.")
@click.option("--report", metavar="OUT.html", type=OUTPUT, help="What was found and why, as one page with plots.")
@click.option(
    "--write-config",
    "config_file",
    metavar="OUT.yaml",
    type=OUTPUT,
    help="The machine file with the causes as effects.",
)
@click.option("--next-program", metavar="OUT.nc", type=OUTPUT, help="NC program of the proposed next experiment.")
@click.option("--without", multiple=True, metavar="EFFECT", help="Take an effect out of the library; repeatable.")
@quiet_option
def command(
    experiment: str,
    json_file: str | None,
    report: str | None,
    config_file: str | None,
    next_program: str | None,
    without: tuple[str, ...],
    quiet: bool,
) -> None:
    """Find out why a machine and its model differ.

    EXPERIMENT is a YAML file that names the config under judgement and the runs with their programs and logs.
    """
    if report:
        from camcomp.report.page import plot_library

        plot_library()  # a missing library is told before the work, not after it
    with working(f"diagnosing {experiment}", quiet=quiet):
        result, done, opened = examine(experiment, without)
    for each in opened.notes if opened is not None else ():
        click.echo(f"note: {each}", err=True)
    outputs: dict[str, bytes] = {}
    if json_file or not (report or config_file or next_program):
        outputs[json_file or STANDARD] = result.to_json()
    if report:
        from camcomp.diagnosis.report.views import report_of

        with working("drawing the report", quiet=quiet):
            outputs[report] = report_of(experiment, result, done, opened)
    inputs: tuple[str, ...] = (experiment,)
    if config_file:
        from camcomp.model.config.load import load_experiment

        configs = load_experiment(experiment).config
        inputs = (experiment, *configs)
        outputs[config_file] = _machine_with_causes(configs, result, config_file).encode()
    failure: CheckFailed | None = None
    if next_program:
        try:
            outputs[next_program] = _next_program(done, opened).encode()
        except CheckFailed as error:
            failure = error
    write_all(outputs, inputs=inputs)
    sys.stdout.flush()
    from camcomp.diagnosis.report.answer import answer_lines

    say(*answer_lines(result), quiet=quiet)
    if failure is not None:
        raise failure
