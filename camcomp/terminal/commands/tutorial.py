"""camcomp tutorial."""

from pathlib import Path

import click

from camcomp.terminal.commands.init import FOLDER
from camcomp.terminal.progress import say


@click.command()
@click.argument("directory", metavar="DIR", type=FOLDER)
def command(directory: Path) -> None:
    """Write the tutorial with its samples and machine files into a folder.

    DIR is made when it is not there. Nothing in it is overwritten. All commands of the tutorial run in DIR.
    """
    from camcomp.api.project import write_tutorial

    written = write_tutorial(directory)
    say(f"wrote {len(written)} files")
    say(f"next: cd {directory}, and read {Path('samples', 'tutorial.md')}")
