"""The bench: `python -m tests.validation run NAME` makes, asks and scores; `report` writes docs/validation."""

from __future__ import annotations

import os

for name in ("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import click

from tests.validation import store
from tests.validation.measured import bench


@click.group()
def main() -> None:
    """Measure how often the diagnosis is right."""


@main.command("run")
@click.argument("name", type=click.Choice(["measured"]))
@click.option("--only", multiple=True, help="Data sets; default all that are here.")
@click.option("--again", is_flag=True, help="Ask anew what this code was asked before.")
def run(name: str, only: tuple[str, ...], again: bool) -> None:
    """Run a generator on the code of this checkout; a second run goes on where the first one stopped."""
    result = store.opened("measured", None)
    rows = [] if again else result.get("rows", [])
    there = {(row["set"], row["split"]) for row in rows}
    for split in bench.splits(only):
        if (split.set, split.name) not in there:
            rows += bench.judge(split)
            store.save({**result, "rows": rows})
        click.echo(bench.render([r for r in rows if (r["set"], r["split"]) == (split.set, split.name)]))


if __name__ == "__main__":
    main()
