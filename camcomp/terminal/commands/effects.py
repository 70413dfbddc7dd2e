"""camcomp effects."""

import json

import click


def describe() -> list[dict[str, object]]:
    """Every effect of the shelf, those of entry points included, ready for JSON."""
    from camcomp.ground import shelf
    from camcomp.model.signal_path import HOOKS

    out: list[dict[str, object]] = []
    for name in shelf.members("effects"):
        effect = shelf.load("effects", name)
        if not effect.PARAMETERS:
            continue
        out.append({
            "effect": name,
            "stage": effect.STAGE,
            "target": {"actuator": "actuator", "machine": None, "either": "actuator or null"}[effect.TARGET],
            "description": (effect.__doc__ or "").strip().split("\n")[0],
            "source": effect.SOURCE,
            "hooks": [each for each in HOOKS if hasattr(effect, each)],
            "parameters": [
                {
                    "name": p.name, "unit": p.unit, "nominal": p.nominal, "low": p.low, "high": p.high,
                    "typical": p.scale, "tolerance": p.tolerance, "relative": p.log, "source": p.source,
                }
                for p in effect.PARAMETERS
            ],
        })  # fmt: skip
    return out


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Machine-readable.")
def command(as_json: bool) -> None:
    """List what can make a machine differ from its model.

    Each is one plug-in; a config names them under `effects:`, diagnose finds them, compensate removes them.
    """
    effects = describe()
    if as_json:
        click.echo(json.dumps(effects, indent=1))
        return
    for each in effects:
        target = "" if each["target"] is None else f"  target: {each['target']}"
        click.echo(f"{each['effect']}  [{each['stage']}]{target}\n    {each['description']}")
        for p in each["parameters"]:  # type: ignore[attr-defined]
            unit = "" if p["unit"] == "1" else f" {p['unit']}"
            click.echo(f"    {p['name']}: {p['nominal']:g}{unit} = none, {p['low']:g} to {p['high']:g}")
