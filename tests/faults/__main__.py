"""The fault campaign: `python -m tests.faults --minutes N` prints what was tried, what survived, what was lost."""

import sys

import click

from tests.faults.table import campaign, render


@click.command()
@click.option("--minutes", default=10.0, show_default=True, help="For so long; 0: a few of every quick kind.")
@click.option("--seed", default=1, show_default=True)
@click.option("--only", multiple=True, help="Kinds whose name holds this; repeatable.")
def main(minutes, seed, only):
    """Do to camcomp what computers do to programs."""
    counts = campaign(minutes, seed, only, tell=lambda text: click.echo(text, err=True))
    click.echo(render(counts))
    sys.exit(any(count.lost for count in counts.values()))


if __name__ == "__main__":
    main()
