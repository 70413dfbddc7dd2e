"""Trials on recorded motions: `python -m tests.validation.recorded make` writes experiments, `score` asks camcomp about them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click
import numpy as np

from tests.validation import counting
from tests.validation import scoring as judging
from tests.validation.recorded import sensitivity as changes
from tests.validation.recorded.experiment import Plan, make, truth_json, write
from tests.validation.recorded.faults import every
from tests.validation.recorded.machines import MACHINES
from tests.validation.recorded.sensors import CHANNELS, Sensors
from tests.validation.recorded.unmodelled import ON_ACTUATORS, STRANGE

KINDS = ("null", "single", "pair", "unknown", "beside", "imperfect")
IN_TURNS = ("null", "single", "single", "pair", "unknown", "imperfect")  # kinds of a mixture
# what data may be like: changes of the sensors, and of the plan
MESS: dict[str, tuple[dict, dict]] = {
    "tails": ({"tails": True}, {}),
    "outliers": ({"outliers": 0.005}, {}),
    "drift": ({"slow": 0.3, "drift": 0.3}, {}),
    "coarse": ({"tip_step_mm": 0.005}, {}),
    "clock": ({"clock_ppm": 200.0, "jitter_s": 5e-4}, {}),
    "late-lines": ({"line_rows": 3}, {}),
    "early-lines": ({"line_rows": -3}, {}),
    "20-hertz": ({}, {"hertz": 20.0}),
    "200-hertz": ({}, {"hertz": 200.0}),
    "middle": ({}, {"middle": True}),
    "waits": ({}, {"waits": True, "rapids": True}),
}


def messy(base: Plan, names: tuple[str, ...]) -> Plan:
    """The plan with all that is said of its data."""
    for name in names:
        sensors, more = MESS[name]
        base = replace(base, sensors=replace(base.sensors, **sensors), **more)
    return base


def plan(kind: str, index: int, seed: int, base: Plan, ratios: tuple[float, ...]) -> Plan:
    """The plan of one experiment; kinds go round the library and the strange faults as index grows."""
    rng = np.random.default_rng([seed, 1])
    machine = MACHINES[base.machine]
    names = every(machine)
    if kind == "single":
        causes, sizes = [names[(index * 7) % len(names)]], ratios or (1.0, 3.0, 10.0)
        chosen = [sizes[index % len(sizes)]]
    elif kind == "pair":
        first = names[(index * 11) % len(names)]
        others = [each for each in names if each[0] != first[0]]
        causes = [first, others[int(rng.integers(len(others)))]]
        chosen = [3.0, float(rng.choice([3.0, 6.0, 9.0]))]
    elif kind in ("unknown", "beside"):
        sizes = ratios or (3.0, 10.0)
        odd = sorted(STRANGE)[(index * 5) % len(STRANGE)]
        causes = [(odd, str(rng.choice(machine.actuators if odd in ON_ACTUATORS else list("xyz"))))]
        chosen = [sizes[index % len(sizes)]]
        if kind == "beside":
            causes, chosen = [names[(index * 13) % len(names)], *causes], [9.0, 5.0]
    else:
        causes, chosen = [], []
    return replace(
        base, seed=seed, kind=kind, causes=tuple(causes), ratios=tuple(chosen), imperfect=kind == "imperfect"
    )


def mixed(seed: int, clean: bool) -> tuple[str, Plan]:
    """Kind and plan of one of a mixture: machines, kinds, what is poor about the data and channels go round at their own pace."""
    kind = IN_TURNS[seed // len(MACHINES) % len(IN_TURNS)]
    channels = "full" if clean else list(CHANNELS)[(seed + seed // (len(MACHINES) * len(IN_TURNS))) % len(CHANNELS)]
    machine = list(MACHINES)[seed % len(MACHINES)]
    base = Plan(0, machine=machine, channels=channels, sensors=Sensors(tip_mm=3e-3), rows=300, runs=4)
    base = base if clean else messy(base, (list(MESS)[seed % len(MESS)],))
    return kind, plan(kind, seed, seed, base, (3.0, 10.0))


@click.group()
def main():
    """Make experiments and score the answers."""


@main.command("make")
@click.option("--out", type=click.Path(path_type=Path), required=True)
@click.option("--kind", type=click.Choice(KINDS), required=True)
@click.option("--machine", type=click.Choice(sorted(MACHINES)), default="orthoglide")
@click.option("--count", default=10)
@click.option("--seed", default=1, help="Of the first experiment; the next ones count on.")
@click.option("--noise-um", default=3.0, help="Deviation of the measured tip per axis.")
@click.option("--channels", type=click.Choice(sorted(CHANNELS)), default="full")
@click.option("--ratio", "ratios", type=float, multiple=True, help="Sizes over the noise; default 1, 3, 10.")
@click.option("--rapids", type=click.Choice(["yes", "no", "mixed"]), default="mixed", help="Rows of rapids and rest.")
@click.option("--stated", type=click.Choice(["yes", "no", "mixed"]), default="mixed", help="Key sd of the experiment.")
@click.option("--mess", multiple=True, type=click.Choice(list(MESS)), help="What is poor about the data; repeatable.")
@click.option("--rows", default=500)
@click.option("--runs", default=6)
def make_(out, kind, machine, count, seed, noise_um, channels, ratios, rapids, stated, mess, rows, runs):
    """Write experiments below OUT; their truth goes to OUT/truth."""
    sensors = Sensors(tip_mm=noise_um * 1e-3)
    choice = {"yes": True, "no": False, "mixed": None}
    base = Plan(0, machine=machine, channels=channels, sensors=sensors, rows=rows, runs=runs)
    base = messy(replace(base, rapids=choice[rapids], stated=choice[stated]), mess)
    (out / "truth").mkdir(parents=True, exist_ok=True)
    for i in range(count):
        name, answer = f"e-{seed + i:05d}", out / "truth" / f"e-{seed + i:05d}.json"
        if answer.exists():
            click.echo(f"{name} is there")
            continue
        wanted = plan(kind, i, seed + i, base, ratios)
        made = make(wanted)
        write(made, wanted, out / name)
        answer.write_text(truth_json(made))
        click.echo(f"{name} {kind} {[(c['effect'], c['target'], round(c['ratio'], 2)) for c in made.record['causes']]}")


@main.command("mixed")
@click.option("--out", type=click.Path(path_type=Path), required=True)
@click.option("--count", default=10)
@click.option("--seed", default=1, help="Of the first experiment; the next ones count on.")
@click.option("--clean", is_flag=True, help="All channels and nothing poor about the data.")
def mixed_(out, count, seed, clean):
    """Write experiments of all kinds on all machines in turns, with poor channels and messy data; see make."""
    (out / "truth").mkdir(parents=True, exist_ok=True)
    for i in range(count):
        name, answer = f"e-{seed + i:05d}", out / "truth" / f"e-{seed + i:05d}.json"
        if answer.exists():
            continue
        kind, wanted = mixed(seed + i, clean)
        made = make(wanted)
        write(made, wanted, out / name)
        answer.write_text(truth_json(made))
        click.echo(f"{name} {kind} {[(c['effect'], c['target'], round(c['ratio'], 2)) for c in made.record['causes']]}")


@main.command("score")
@click.argument("folder", type=click.Path(path_type=Path, exists=True))
@click.option("--results", type=click.Path(path_type=Path), help="Default FOLDER/results.jsonl; resumed if there.")
@click.option("--jobs", default=1)
@click.option("--only", multiple=True, help="Names of experiments.")
@click.option("--list", "listed", is_flag=True, help="Print every answer too.")
def score_(folder, results, jobs, only, listed):
    """Ask camcomp about every experiment of FOLDER and print the rates."""
    rows = judging.run(folder, results or folder / "results.jsonl", jobs, only)
    if listed:
        click.echo(judging.listing(rows) + "\n")
    result: dict = {}
    for i, row in enumerate(rows):
        counting.add(result, i, list(counting.of_answer(row)), [row])
    for label, (hits, total) in result.get("counts", {}).items():
        low, high = judging.wilson(hits, total)
        click.echo(f"{label:<72} {hits} of {total} ({low:.2f} to {high:.2f})")


@main.command("sensitivity")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder of the fixed set, made if missing.")
@click.argument("constants", nargs=-1, metavar="MODULE:NAME...")
def sensitivity_(out, constants):
    """Halve and double constants below camcomp/diagnosis, e.g. search.cause_search:LEFT_OPEN, and count answers that differ."""
    bench = changes.Bench([(each.split(":")[0], each.split(":")[1]) for each in constants])
    for each in changes.written(out):
        bench.ask(each)
        click.echo(f"{each.parent.name} {bench.usual[each]}", err=True)
        for constant in bench.constants:
            half, double = bench.changed[constant]
            click.echo(f"{':'.join(constant)} {half} {double} of {bench.met[constant]}")


if __name__ == "__main__":
    main()
