"""camcomp effects."""

import json

import click


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Machine-readable.")
@click.option("--library", metavar="DIR", help="With the laws that diagnoses have found before.")
def command(as_json: bool, library: str | None) -> None:
    """List the effects by which a machine can differ from its model.

    Each is one plug-in; a config names them under `effects:`, diagnose finds them, compensate removes them.
    """
    from camcomp.api.effects import described_effects

    effects = described_effects(library)
    if as_json:
        click.echo(json.dumps(effects, indent=1))
        return
    for each in effects:
        target = "" if each["target"] is None else f"  target: {each['target']}"
        click.echo(f"{each['effect']}  [{each['stage']}]{target}\n    {each['description']}")
        for p in each["parameters"]:
            unit = "" if p["unit"] == "1" else f" {p['unit']}"
            click.echo(f"    {p['name']}: {p['nominal']:g}{unit} = none, {p['low']:g} to {p['high']:g}")
