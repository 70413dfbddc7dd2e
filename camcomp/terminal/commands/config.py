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
@click.option(
    "--control", type=click.Choice(["linuxcnc", "siemens", "heidenhain"]), default="linuxcnc", show_default=True,
    help="Whose table: LinuxCNC's COMP_FILE, or CSV of Siemens' $AA_ENC_COMP or of Heidenhain's *.COM.",
)  # fmt: skip
@click.option("--comp-type", type=click.Choice(["0", "1"]), default="0", show_default=True, help="COMP_FILE_TYPE.")
@click.option("-o", "--output", metavar="FILE", type=OUTPUT, help="The file; default and -: standard output.")
def screw_file(
    *, configs: tuple[str, ...], actuator: str, start: float, end: float, step: float, control: str, comp_type: str,
    output: str | None,
) -> None:  # fmt: skip
    """Write a control's table for the effects in one drive: pitch, wobble, play, error table.

    A control that uses it makes up for them itself; take them out of the machine file then. Siemens' table has one value per
    position, the mean of both directions. Heidenhain's holds errors, carriage minus scale.
    """
    from camcomp.api.machine import load_machine
    from camcomp.api.settings import screw_file as written

    text = written(load_machine(*configs), actuator, (start, end, step), control, int(comp_type))
    write_all({output or STANDARD: text}, inputs=configs)


@command.command("skew")
@config_option
@click.option("--control", type=click.Choice(["marlin", "klipper"]), required=True, help="Firmware of the control.")
@click.option("-o", "--output", metavar="FILE", type=OUTPUT, help="The command; default and -: standard output.")
def skew(configs: tuple[str, ...], control: str, output: str | None) -> None:
    """Write the command by which a firmware corrects squareness itself: Marlin's M852, Klipper's SET_SKEW.

    It goes by the `squareness` among the effects; take these out of the machine file then.
    """
    from camcomp.api.machine import load_machine
    from camcomp.api.settings import skew as written

    write_all({output or STANDARD: written(load_machine(*configs), control)}, inputs=configs)
