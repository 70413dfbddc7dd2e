"""camcomp config."""

import click

from camcomp.ground.errors import shown
from camcomp.ground.files import write_all
from camcomp.ground.places import STANDARD
from camcomp.terminal.commands._options import OUTPUT, config_option


@click.group()
def command() -> None:
    """Show the values in force of several YAML files, or write a screw file."""


@command.command()
@config_option
@click.option("--origin", is_flag=True, help="Say for every value in which file and line it stands.")
def show(configs: tuple[str, ...], origin: bool) -> None:
    """List every value that is in force, defaults included."""
    from camcomp.api.settings import values

    for name, value, place in values(configs):
        click.echo(shown(f"{name} = {value}" + (f"  # {place}" if origin else "")))


@command.command("screw-file")
@config_option
@click.option("--actuator", required=True, help="Name of the slide.")
@click.option("--from-mm", "start", type=float, required=True, help="Where the table begins on the slide's scale.")
@click.option("--to-mm", "end", type=float, required=True, help="Where it ends.")
@click.option("--step-mm", "step", type=float, default=10.0, show_default=True, help="Between its rows.")
@click.option("--comp-type", type=click.Choice(["0", "1"]), default="0", show_default=True, help="COMP_FILE_TYPE.")
@click.option("-o", "--output", metavar="FILE", type=OUTPUT, help="The file; default and -: standard output.")
def screw_file(
    configs: tuple[str, ...], actuator: str, start: float, end: float, step: float, comp_type: str, output: str | None
) -> None:
    """Write LinuxCNC's screw file (COMP_FILE) for the effects in one drive: pitch, wobble, play, error table.

    A controller with this file compensates for these effects itself; remove them from the machine file then.
    """
    from camcomp.api.machine import load_machine
    from camcomp.api.settings import screw_file as written

    text = written(load_machine(*configs), actuator, start, end, step, int(comp_type))
    write_all({output or STANDARD: text}, inputs=configs)
