"""camcomp explain."""

from difflib import get_close_matches

import click

from camcomp.ground.errors import ConfigError
from camcomp.ground.rules import RULES


@click.command()
@click.argument("rule", required=False)
def command(rule: str | None) -> None:
    """Explain a rule id of an error message.

    Without RULE all ids are listed.
    """
    if rule is None:
        for name, each in sorted(RULES.items()):
            click.echo(f"{name}  {each.title}")
        return
    name = rule.upper()
    if name not in RULES:
        close = get_close_matches(name, RULES, n=1)
        hint = f"did you mean {close[0]}?" if close else None
        raise ConfigError("CC214", f"there is no rule '{rule}'", hint=hint)
    found = RULES[name]
    click.echo(f"{name}: {found.title}\n\n{click.wrap_text(found.explanation, 100)}")
    if found.hint:
        click.echo(f"\nHint: {found.hint}")
