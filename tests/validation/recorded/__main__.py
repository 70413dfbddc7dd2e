"""Trials on recorded motions: `python -m tests.validation.recorded make` writes experiments, `score` asks camcomp about them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import click
import numpy as np

from tests.validation import scoring as judging
from tests.validation.recorded import left_out_runs as left_out
from tests.validation.recorded import metamorphic
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


@main.command("laws")
@click.option("--out", type=click.Path(path_type=Path), required=True)
@click.option("--count", default=4, help="Experiments; every law is tried on each.")
@click.option("--seed", default=1)
@click.option("--machine", type=click.Choice(sorted(MACHINES)), default="orthoglide")
@click.option("--rows", default=250)
@click.option("--runs", default=3)
@click.option(
    "--of",
    "of",
    type=click.Path(path_type=Path, exists=True),
    help="Folder of experiments to take, in place of making some.",
)
@click.option(
    "--only", multiple=True, type=click.Choice([*metamorphic.LESS, *metamorphic.SAME]), help="Laws; default all."
)
def laws_(out, count, seed, machine, rows, runs, of, only):
    """Try the laws of diagnosis on experiments of every kind with all or few columns, or on the first ones of a folder."""
    results = out / "laws.jsonl"
    out.mkdir(parents=True, exist_ok=True)
    done = [json.loads(line) for line in results.read_text().splitlines()] if results.exists() else []
    there = {(row["name"], row["law"]) for row in done}
    wanted = tuple(only) or (*metamorphic.LESS, *metamorphic.SAME)
    taken = sorted(each.stem for each in (of / "truth").glob("*.json")) if of else []
    for i in range(min(count, len(taken)) if of else count):
        name = taken[i] if of else f"e-{seed + i:05d}"
        todo = [each for each in wanted if (name, each) not in there]
        if not todo:
            continue
        if of is None:
            _law_experiment(out, name, i, seed, machine, rows, runs)
        for row in judging.laws((of or out) / name, out / name, todo, seed + i):
            done.append(row)
            with results.open("a") as file:
                file.write(json.dumps(row) + "\n")
            click.echo(f"{name} {row['law']}: {row['said']}")
    click.echo(judging.render_laws(done))


def _law_experiment(out, name, i, seed, machine, rows, runs):
    """Makes the i-th experiment for laws."""
    kind, channels = ("single", "unknown", "pair")[i % 3], sorted(CHANNELS)[(i * 5) % len(CHANNELS)]
    base = Plan(0, machine=machine, channels=channels, rows=rows, runs=runs, stated=False)
    wish = plan(kind, i + seed, seed + i, base, ())
    made = make(wish)
    write(made, wish, out / name)
    (out / "truth").mkdir(exist_ok=True)
    (out / "truth" / f"{name}.json").write_text(truth_json(made))


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
    click.echo(judging.render(rows))
    click.echo("\nright answers\n" + judging.by_machine(rows))


@main.command("unseen")
@click.argument("folder", type=click.Path(path_type=Path, exists=True))
@click.option("--only", multiple=True, help="Names of experiments.")
def unseen_(folder, only):
    """Leave every run of the experiments below FOLDER out once: does the interval of the shrinkage hold what it shows?"""
    results = folder / "unseen.jsonl"
    rows = [json.loads(line) for line in results.read_text().splitlines()] if results.exists() else []
    there = {row["name"] for row in rows}
    for each in sorted(folder.glob("e-*")):
        if each.name not in there and (not only or each.name in only):
            more = left_out.runs_left_out(each)
            rows += more
            with results.open("a") as file:
                file.writelines(json.dumps(row) + "\n" for row in more)
    click.echo(left_out.render(rows))


@main.command("sensitivity")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder of the fixed set, made if missing.")
@click.argument("constants", nargs=-1, metavar="MODULE:NAME...")
def sensitivity_(out, constants):
    """Halve and double constants below camcomp/diagnosis, e.g. search.cause_search:GATE, and count answers that differ."""
    bench = changes.Bench([(each.split(":")[0], each.split(":")[1]) for each in constants])
    for each in changes.written(out):
        bench.ask(each)
        click.echo(f"{each.parent.name} {bench.usual[each]}", err=True)
        for constant in bench.constants:
            half, double = bench.changed[constant]
            click.echo(f"{':'.join(constant)} {half} {double} of {bench.met[constant]}")


if __name__ == "__main__":
    main()
