"""camcomp schema."""

import json

import click

from camcomp.model.config.schema import config_schema, experiment_schema


@click.command()
@click.option("--experiment", is_flag=True, help="The schema of experiment files instead of machine files.")
def command(experiment: bool) -> None:
    """Print the JSON schema of the YAML files.

    Draft-07. Editors with a YAML language server check and complete machine files with it.
    """
    click.echo(json.dumps(experiment_schema() if experiment else config_schema(), indent=1, ensure_ascii=False))
