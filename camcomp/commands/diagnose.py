"""camcomp diagnose."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camcomp.commands._options import quiet_option
from camcomp.files import STANDARD, read_bytes, write_all
from camcomp.terminal import say, working
from camcomp.writeback import with_causes

if TYPE_CHECKING:
    from camcomp.campaign import Campaign
    from camcomp.diagnose import Diagnosis


def diagnose_experiment(path: str | Path, without: Sequence[str] = ()) -> dict[str, Any]:
    """The result mapping of an experiment file, ready for JSON. Raises CamcompError."""
    return examine(path, without)[0]


def examine(
    path: str | Path, without: Sequence[str] = ()
) -> "tuple[dict[str, Any], Diagnosis | None, Campaign | None]":
    """The result, and what it was drawn from; nothing of that for logs that have a study of their own."""
    from camcomp.campaign import open_campaign
    from camcomp.diagnose import diagnose
    from camcomp.unprogrammed import study_of

    if (study := study_of(path, without)) is not None:
        return study, None, None
    campaign = open_campaign(path)
    done = diagnose(campaign.job, campaign.twin, campaign.runs, holdout=campaign.experiment.holdout, without=without)
    return done.result, done, campaign


@click.command()
@click.argument("experiment")
@click.option("--json", "json_file", metavar="OUT.json", help="The result; - is standard output.")
@click.option("--report", metavar="OUT.html", help="What was found and why, as one page with plots.")
@click.option("--write-config", "config_file", metavar="OUT.yaml", help="The machine file with the causes as effects.")
@click.option("--next-program", metavar="OUT.nc", help="NC program of the proposed next experiment.")
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
        result, done, campaign = examine(experiment, without)
    outputs: dict[str, bytes] = {}
    if json_file or not (report or config_file or next_program):
        outputs[json_file or STANDARD] = (json.dumps(result, indent=1, allow_nan=False) + "\n").encode()
    if report:
        from camcomp.report.diagnosed import report_of

        with working("drawing the report", quiet=quiet):
            outputs[report] = report_of(experiment, result, done, campaign)
    inputs: tuple[str, ...] = (experiment,)
    if config_file:
        from camcomp.config import load_experiment

        # The last file wins key by key, so only there are the causes sure to count.
        machine = load_experiment(experiment).config[-1]
        inputs = (experiment, *load_experiment(experiment).config)
        outputs[config_file] = with_causes(read_bytes(machine).decode("utf-8-sig"), result["causes"]).encode()
    if next_program and done is not None and done.proposal is not None:
        outputs[next_program] = done.proposal.candidate.program.encode()
    write_all(outputs, inputs=inputs)
    sys.stdout.flush()
    from camcomp.report.answer import answer_lines

    say(*answer_lines(result), quiet=quiet)
