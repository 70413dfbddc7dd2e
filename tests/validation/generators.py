"""All generators: what one seed makes, how it is judged, which rates it counts for, and which of them are wanted.

`first_seed` is above all seeds that anything was tuned on; results say which one is the next free one.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation import counting, scoring
from tests.validation.recordings import recording

Row = dict[str, Any]
Outcomes = list[tuple[str, bool]]
FIRST = 10_000_000
FOR_GENERATORS = tuple(each for each in recording.SETS if each != "inches_and_cycles")

WANTED = {
    "nothing wrong: verdict none": "at least 0.95",
    "one cause from 2.7 x noise: first, or among the alternatives": "at least 0.95",
    "one cause from 3 x noise: first, or among the alternatives": "at least 0.95",
    "two causes: both named": "at least 0.85",
    "unmodelled effect: verdict unknown": "at least 0.90",
    "complete library: false unknown": "at most 0.03",
    "false cause with p above 0.5": "at most 0.02",
    "false cause with p above 0.8": "at most 0.01",
    "95 % interval holds the true value": "0.90 to 0.98",
    "95 % interval of the shrinkage holds on a further run": "0.90 to 0.98",
    "two causes with the same log: one named alone": "0",
    "less data: another single cause": "0",
}


@dataclass(frozen=True)
class Generator:
    """A kind of experiment with known truth."""

    title: str
    about: str
    ask: Callable[[int], list[Row]]  # makes the experiment of a seed, asks camcomp, judges
    outcomes: Callable[[Row], Any]

    def run(self, seed: int) -> tuple[int, Outcomes, list[Row]]:
        """All of one seed."""
        rows = self.ask(seed)
        return seed, [(name, bool(hit)) for row in rows for name, hit in self.outcomes(row)], rows


@cache
def _library() -> frozenset[str]:
    return frozenset(scoring.library())


def _judged(folder: Path, name: str) -> list[Row]:
    """One row: the answer to the experiment `name` below a folder against its truth."""
    row = scoring.trial((str(folder / name), str(folder / "truth" / f"{name}.json"), set(_library())))
    if "failed" in row:
        return [row | {"wrong": row["failed"]}]
    if scoring.right(row):
        return [row]
    said = ", ".join(f"{effect}:{target} {p}" for effect, target, p in row["found"])
    return [row | {"wrong": f"{row['kind']} {row['true']} {row['foreign']} -> {row['verdict']} {said}"}]


def _drawn(seed: int, make: Callable[[int, Path, str | None], object]) -> list[Row]:
    """An experiment of a generator written from the contract, on a set of recordings that goes round with the seed."""
    with tempfile.TemporaryDirectory() as place, recording.taken_from(FOR_GENERATORS[seed % len(FOR_GENERATORS)]):
        make(seed, Path(place), None)
        return _judged(Path(place), f"e-{seed}")


def programs(seed: int) -> list[Row]:
    """Serial machines for odd seeds, parallel ones for even ones."""
    from tests.validation.parallel.__main__ import write
    from tests.validation.serial.make import make

    return _drawn(seed, make if seed % 2 else write)


def axes(seed: int) -> list[Row]:
    """Logs of single axes."""
    from tests.validation.axes.make import make

    return _drawn(seed, make)


def poses(seed: int) -> list[Row]:
    """Static poses of arms."""
    from tests.validation.poses.make import make

    return _drawn(seed, make)


def recorded(seed: int) -> list[Row]:
    """Five machines and all kinds in turn; clean data for even seeds, poor and incomplete data for odd ones."""
    from tests.validation.recorded.__main__ import mixed
    from tests.validation.recorded.experiment import make, truth_json, write

    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        _, plan = mixed(seed, clean=seed % 2 == 0)
        made = make(plan)
        write(made, plan, folder / "e-1")
        (folder / "truth").mkdir()
        (folder / "truth" / "e-1.json").write_text(truth_json(made))
        return _judged(folder, "e-1")


def orthoglide(seed: int) -> list[Row]:
    """A case on the reference Orthoglide, drawn by the seed from all categories."""
    from tests.validation.orthoglide.cases import build
    from tests.validation.orthoglide.run import run_case

    cases = build(0.1, seed)
    row = run_case(cases[int(np.random.default_rng([seed, 3]).integers(len(cases)))])
    wrong = any(hit == (name in BAD) for name, hit in counting.of_orthoglide(row) if not name.startswith("95 %"))
    if wrong:
        row["wrong"] = row.get("failed") or f"{row['category']} {row['true']} -> {row['verdict']} {row['found']}"
    return [row]


def hidden_laws(seed: int) -> list[Row]:
    """Experiments with a law and without one in turn, on three machines, at 10 and 3 x noise."""
    from tests.validation.recorded import hidden_laws as laws
    from tests.validation.recorded.machines import MACHINES
    from tests.validation.recorded.unmodelled import ON_ACTUATORS

    names = [*laws.TRUTH, "null"]
    effect, turn = names[seed % len(names)], seed // len(names)
    machine, ratio = ("orthoglide", "puu", "router")[turn % 3], (10.0, 3.0)[turn % 2]
    rng = np.random.default_rng([seed, 31])
    target = str(rng.choice(MACHINES[machine].actuators if effect in ON_ACTUATORS else ["x", "z"]))
    with tempfile.TemporaryDirectory() as place:
        return [laws.judged(effect, target, machine, seed, 0.0 if effect == "null" else ratio, Path(place) / "e")]


def changed_data(seed: int) -> list[Row]:
    """One change of data, in turn, on an experiment of the generator `programs`."""
    from tests.validation.parallel.__main__ import write
    from tests.validation.recorded import metamorphic
    from tests.validation.serial.make import make

    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (make if seed % 2 else write)(seed, folder, None)
        names = [*metamorphic.LESS, *metamorphic.SAME]
        return scoring.laws(folder / f"e-{seed}", folder / "changed", [names[seed // 2 % len(names)]], seed)


def left_out_runs(seed: int) -> list[Row]:
    """Every run of an experiment with causes, on five machines in turn, held out once."""
    from tests.validation.recorded.__main__ import mixed
    from tests.validation.recorded.experiment import make, write
    from tests.validation.recorded.left_out_runs import runs_left_out

    with tempfile.TemporaryDirectory() as place:
        _, plan = mixed(seed, clean=True)
        write(make(plan), plan, Path(place) / "e")
        return runs_left_out(Path(place) / "e")


def every_machine(seed: int) -> list[Row]:
    """An effect of the library on a shipped machine, all of them in turn; the seed draws the noise."""
    from tests.validation.every_machine import grid

    every = [(machine, fault) for machine in grid.MACHINES for fault in (None, *grid.faults(machine))]
    machine, fault = every[(seed * 37) % len(every)]
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as place:
        verdict, wrong = grid.answer(Path(place), machine, fault, seed)
    row: Row = {"machine": machine, "seconds": time.perf_counter() - began, "right": not wrong}
    return [row | ({"wrong": f"{machine} {fault} {verdict} {'; '.join(wrong)}"} if wrong else {})]


def _on_machine(row: Row) -> Outcomes:
    return [("whole answer right", row["right"]), (f"{row['machine']}: whole answer right", row["right"])]


BAD = ("no answer", "complete library: false unknown", "two causes with the same log: one named alone")
GENERATORS = {
    "programs": Generator(
        "Programs on serial and parallel machines",
        "Router, arm, Cartesian machine, Orthoglide, delta and 3-PUU follow motions that LinuxCNC commanded. Plants, sensors and "
        "truth are written from the contract alone. Half of the experiments have poor channels, half have messy data.",
        programs, counting.of_answer,
    ),
    "recorded": Generator(
        "Programs on five machines, kinds in turn",
        "No cause, one, two, an unmodelled effect and an imperfect model in turn, at 3 and 10 x noise, four runs of 300 rows; "
        "every other experiment has poor or incomplete data. The plant shares geometry and names with camcomp.",
        recorded, counting.of_answer,
    ),
    "axes": Generator(
        "Logs of axes",
        "Set-points, encoders and drive forces of one to three axes in a control loop, without a tip.",
        axes, counting.of_answer,
    ),
    "poses": Generator(
        "Static poses of arms",
        "Joint angles and measured tips of a UR10 and a KUKA with faults in joints, links and springs.",
        poses, counting.of_answer,
    ),
    "orthoglide": Generator(
        "Withheld causes and equivalent pairs",
        "The reference Orthoglide: causes withheld from the library, pairs whose logs are the same, poor channels.",
        orthoglide, counting.of_orthoglide,
    ),
    "every_machine": Generator(
        "Every effect on every machine",
        "camcomp's own model simulates every effect of the library on all shipped machines; noise is added. This judges the "
        "plumbing, not the physics.",
        every_machine, _on_machine,
    ),
    "hidden_laws": Generator(
        "Laws that no library has",
        "An unmodelled law acts on recorded motions; the diagnosis has to find its form and place.",
        hidden_laws, counting.of_hidden_law,
    ),
    "changed_data": Generator(
        "Less data, and the same data in another form",
        "Fewer rows, columns or runs must not name another cause; other names, orders or frames must change nothing.",
        changed_data, counting.of_changed_data,
    ),
    "left_out_runs": Generator(
        "Shrinkage on a further run",
        "Every run is left out once: does the interval of the predicted shrinkage hold on it?",
        left_out_runs, counting.of_left_out_run,
    ),
}  # fmt: skip


def seed_rows(name: str, seed: int) -> tuple[int, Outcomes, list[Row]]:
    """One seed of a generator, as a worker runs it."""
    return GENERATORS[name].run(seed)


def as_text(row: Row) -> str:
    """A row for reading."""
    return json.dumps(row, default=str)
