"""camcomp schema."""

import json

import click

from camcomp.model.config.schema import Schema, config_schema, experiment_schema, result_schema


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
    schema = _schema_of(result) if result else experiment_schema() if experiment else config_schema()
    click.echo(json.dumps(schema, indent=1, ensure_ascii=False))


def _schema_of(result: str) -> Schema:
    if result == "diagnosis":
        from camcomp.diagnosis.result.types import DiagnosisResult

        return result_schema(DiagnosisResult, "camcomp diagnose --json")
    from camcomp.compensation.program.result import Summary, Verification

    if result == "summary":
        return result_schema(Summary, "camcomp compensate --summary")
    return result_schema(Verification, "camcomp verify --json")
