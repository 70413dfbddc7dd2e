"""One more run of an experiment that is already written: the same machine executes a given program, later."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.validation.plants.experiments import CHANNELS, Made, Plan, even, observe_all, table, write_log
from tests.validation.plants.machine import Run, Truth
from tests.validation.plants.motion import Timeline, read


def add_run(
    folder: Path,
    made: Made,
    plan: Plan,
    program: str,
    *,
    cutting: bool,
    channels: str,
    started_s: float,
    truth: Truth | None = None,
) -> None:
    """Executes `program` on the machine of `made` (or on what became of it, `truth`) and adds program, log and run."""
    number = len(list(folder.glob("log-*.csv"))) + 1
    worn = made.runs[-1].cut_before_min + made.runs[-1].timeline.log_end / 60 * made.runs[-1].cutting
    run = Run(Timeline(read(program)), cutting, started_s, worn)
    state = observe_all([run], truth or made.truth, [even(run, plan.samples)])[0]
    rng = np.random.default_rng([plan.seed, 13, number])
    assert channels in CHANNELS
    (folder / f"program-{number}.nc").write_text(program)
    write_log(folder / f"log-{number}.csv", *table(state, replace(plan, channels=channels), rng))
    with (folder / "experiment.yaml").open("a") as out:
        out.write(
            f"  - {{name: run-{number}, program: program-{number}.nc, log: log-{number}.csv, "
            f"cutting: {str(cutting).lower()}, started_s: {started_s}}}\n"
        )
