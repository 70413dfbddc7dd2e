"""camcomp config."""

import click

from camcomp.model.config.in_force import values_in_force
from camcomp.model.config.load import load_config
from camcomp.terminal.commands._options import config_option


@click.group()
def command() -> None:
    """Show what several YAML files make together."""


@command.command()
@config_option
@click.option("--origin", is_flag=True, help="Say for every value in which file and line it stands.")
def show(configs: tuple[str, ...], origin: bool) -> None:
    """List every value that is in force, defaults included."""
    for name, value, place in list(values_in_force(load_config(configs), folders=True)):
        click.echo(f"{name} = {value}" + (f"  # {place}" if origin else ""))
