"""camcomp canon."""

import click

from camcomp.ground.errors import shown
from camcomp.ground.files import display_name
from camcomp.terminal.commands._options import dialect_option
from camcomp.terminal.progress import say


@click.command()
@click.argument("program", metavar="PROGRAM")
@dialect_option
@click.option("--config", "configs", metavar="FILE", multiple=True, help="Machine whose control reads it.")
def command(program: str, configs: tuple[str, ...]) -> None:
    """Print the motions of a program as camcomp reads them, one line each.

    Source line, kind, end point in mm in the program frame of G54, and for arcs the centre and the sweep; all units,
    offsets, modes, loops and cycles are resolved.
    """
    from camcomp.api.machine import canonical_lines, load_machine, read_program

    read = read_program(program, load_machine(*configs) if configs else None)
    for warning in read.warnings:
        say(f"{display_name(program)}: warning: {warning}")
    click.echo(f"; {read.dialect}, {len(read.path)} motions")
    for line in canonical_lines(read):
        click.echo(shown(line))
