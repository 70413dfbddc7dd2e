"""camcomp init."""

from pathlib import Path

import click

from camcomp.terminal.progress import say

FOLDER = click.Path(file_okay=False, path_type=Path)


@click.command()
@click.argument("directory", metavar="DIR", type=FOLDER, required=False)
@click.option(
    "--list", "listing", is_flag=True, help="Name the machines to start from, and where their numbers come from."
)
@click.option("--machine", metavar="NAME", help="Machine to start from; default: orthoglide.")
@click.option("--from-urdf", "urdf", metavar="FILE", help="Arm whose geometry and masses the machine file takes.")
@click.option("--tip", metavar="LINK", help="Link of the URDF that carries the tool; default: the end of the chain.")
@click.option("--base", metavar="LINK", help="Link of the URDF that stands still; default: the root.")
def command(
    directory: Path | None, listing: bool, machine: str | None, urdf: str | None, tip: str | None, base: str | None
) -> None:
    """Start a project: a machine file, a program, a README.

    DIR is made when it is not there. Nothing in it is overwritten.
    """
    from camcomp.api.project import machines, start_project

    if listing:
        found = machines()
        width = max(len(each.name) for each in found)
        for each in found:
            click.echo(f"{each.name:<{width}}  {each.title} ({each.source or 'no source stated'})")
        return
    if directory is None:
        raise click.UsageError("name the folder of the project, or ask for --list")
    if machine is not None and urdf is not None:
        raise click.UsageError("--machine and --from-urdf are two machines; ask for one")
    written, notes = start_project(directory, machine=machine, urdf=urdf, tip=tip, base=base)
    for note in notes:
        say(note)
    for path in written:
        say(f"wrote {path}")
    say(f"next: camcomp compensate {directory / 'groove.nc'} --config {directory / 'machine.yaml'}")
