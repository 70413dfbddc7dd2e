"""camcomp schema."""

import json

import click


@click.command()
@click.option("--experiment", is_flag=True, help="The schema of experiment files instead of machine files.")
@click.option(
    "--result",
    type=click.Choice(["diagnosis", "summary", "verify"]),
    help="The schema of a result: diagnose --json, compensate --summary, verify --json.",
)
def command(experiment: bool, result: str | None) -> None:
    """Print the JSON schema of the YAML files, or of a result.

    Draft-07. Editors with a YAML language server check and complete machine files with it.
    """
    if experiment and result:
        raise click.UsageError("--experiment and --result are two schemas; ask for one")
    from camcomp.api.settings import schema_of

    schema = schema_of(result or ("experiment" if experiment else "config"))
    click.echo(json.dumps(schema, indent=1, ensure_ascii=False))
