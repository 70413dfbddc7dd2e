"""`python -m tests.validation.orthoglide make` writes one experiment, `samples` those under samples/diagnosis."""

from __future__ import annotations

import json
from pathlib import Path

import click

from tests.validation import runner
from tests.validation.orthoglide import samples
from tests.validation.plants.causes import Cause
from tests.validation.plants.designs import DESIGNS
from tests.validation.plants.experiments import CHANNELS, Plan, make, truth_json, write


@click.group()
def main():
    """Write experiments on the reference Orthoglide."""


@main.command("make")
@click.option("--effect", "effects", multiple=True, help="effect, effect:target; repeatable")
@click.option("--ratio", "sizes", type=float, multiple=True, help="Size over noise, one per effect.")
@click.option("--design", type=click.Choice(DESIGNS), default="six")
@click.option("--channels", type=click.Choice(sorted(CHANNELS)), default="all")
@click.option("--samples", default=500)
@click.option("--seed", default=1)
@click.option("--out", type=click.Path(path_type=Path), required=True)
@click.option("--truth", type=click.Path(path_type=Path), help="Where the answer goes; default OUT.truth.json.")
def one(effects, sizes, design, channels, samples, seed, out, truth):
    """Write one experiment; the truth goes next to the folder."""
    causes = []
    for i, text in enumerate(effects):
        name, _, target = text.partition(":")
        causes.append(Cause(name, target or None, seed + 7919 * (i + 1)))
    ratios = tuple(sizes) if len(sizes) == len(causes) else tuple([sizes[0] if sizes else 3.0] * len(causes))
    plan = Plan(seed, tuple(causes), ratios, design, channels, samples)
    made = make(plan)
    click.echo(write(made, plan, out, runner.CONFIG))
    path = truth or out.with_name(out.name + ".truth.json")
    path.write_text(truth_json(made, plan))
    click.echo(json.dumps(made.record["causes"]), err=True)


@main.command("samples")
@click.option("--out", type=click.Path(path_type=Path), default=runner.ROOT / "samples" / "diagnosis")
def samples_(out):
    """Write the shipped sample experiments anew and print their truth."""
    click.echo(json.dumps(samples.make_all(out), indent=1))


if __name__ == "__main__":
    main()
