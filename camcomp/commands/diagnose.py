"""camcomp diagnose."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from camcomp.files import STANDARD, write_all


def diagnose_experiment(path: str | Path, without: Sequence[str] = ()) -> dict[str, Any]:
    """The result mapping of an experiment file, ready for JSON. Raises CamcompError."""
    from camcomp.campaign import open_campaign
    from camcomp.diagnose import diagnose
    from camcomp.unprogrammed import study_of

    if (study := study_of(path, without)) is not None:
        return study
    campaign = open_campaign(path)
    return diagnose(campaign.job, campaign.twin, campaign.runs, holdout=campaign.experiment.holdout, without=without).result


@click.command()
@click.argument("experiment")
@click.option("--json", "json_file", metavar="OUT.json", help="The result; - is standard output.")
@click.option("--without", multiple=True, metavar="EFFECT", help="Take an effect out of the library; repeatable.")
def command(experiment: str, json_file: str | None, without: tuple[str, ...]) -> None:
    """Find out why a machine and its model differ.

    EXPERIMENT is a YAML file that names the config under judgement and the runs with their programs and logs.
    """
    result = diagnose_experiment(experiment, without)
    text = json.dumps(result, indent=1, allow_nan=False) + "\n"
    write_all({json_file or STANDARD: text.encode()}, inputs=(experiment,))
    sys.stdout.flush()
