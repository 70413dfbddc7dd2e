"""The bench: `python -m tests.validation run NAME` makes, asks and scores; `report` writes docs/validation."""

from __future__ import annotations

import os

for variable in ("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import time
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import click

from tests.validation import calibration, counting, report, speed, store
from tests.validation.generators import FIRST, GENERATORS, seed_rows
from tests.validation.measured import bench


@click.group()
def main() -> None:
    """Measure how often the diagnosis is right."""


@main.command("run")
@click.argument("name", type=click.Choice([*GENERATORS, "measured", "speed"]))
@click.option("--count", default=20, help="Experiments of this code in all, those stored included.")
@click.option("--minutes", type=float, help="Begin no experiment after that.")
@click.option("--processes", default=1)
@click.option("--only", multiple=True, help="measured: these data sets alone.")
@click.option("--again", is_flag=True, help="measured: ask anew what this code was asked before.")
def run(name: str, count: int, minutes: float | None, processes: int, only: tuple[str, ...], again: bool) -> None:
    """Run a generator on the code of this checkout; a second run goes on where the first one stopped."""
    if name == "speed":
        speed.measure(times=3)
        return
    if name == "measured":
        _measured(only, again)
        return
    ends = time.monotonic() + 60 * minutes if minutes else float("inf")
    result = store.opened(name, FIRST)
    first = result["next_seed"]
    seeds = range(first, first + count - result.get("experiments", 0))
    begun = (seed for seed in seeds if time.monotonic() < ends)
    with get_context("spawn").Pool(processes, maxtasksperchild=50) as pool:
        # `imap` would take all seeds at once; a batch per turn lets the clock stop it
        while batch := [seed for _, seed in zip(range(processes), begun, strict=False)]:
            for seed, outcomes, rows in pool.imap(partial(seed_rows, name), batch):
                counting.add(result, seed, outcomes, rows)
                store.save(result)
                click.echo(
                    f"{name} {seed} {'; '.join(row['wrong'] for row in rows if row.get('wrong')) or 'right'}", err=True
                )
    for label, (hits, total) in result.get("counts", {}).items():
        click.echo(f"{label:<72} {report.rate(hits, total)}")


@main.command("calibrate")
@click.argument("kind", type=click.Choice([*calibration.KINDS]))
@click.argument("rows", type=click.Path(path_type=Path))
@click.option("--count", default=60, help="Development seeds in all, those of ROWS included.")
@click.option("--minutes", type=float, help="Begin no experiment after that.")
def calibrate(kind: str, rows: Path, count: int, minutes: float | None) -> None:
    """Answer logs of development seeds into the file ROWS, fit the calibration maps and store them in the package."""
    for row in calibration.answered(kind, rows, count, minutes):
        click.echo(f"{row['name']} {row.get('failed') or row['verdict']} {row.get('calibration', '')}", err=True)
    calibration.store(kind, rows)


def _measured(only: tuple[str, ...], again: bool) -> None:
    result = store.opened("measured", None)
    rows = [] if again else result.get("rows", [])
    there = {(row["set"], row["split"]) for row in rows}
    for split in bench.splits(only):
        if (split.set, split.name) not in there:
            rows += bench.judge(split)
            store.save({**result, "rows": rows})
        click.echo(bench.render([r for r in rows if (r["set"], r["split"]) == (split.set, split.name)]))


@main.command("report")
def report_() -> None:
    """Write docs/validation and the README's lines from the stored results."""
    for path in report.write():
        click.echo(path.relative_to(report.ROOT))


if __name__ == "__main__":
    main()
