"""Experiments on the shipped Cartesian machine cutting air: what its axes do, written down by a function, as logs with noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.validation.plants.motion import Timeline, read

MACHINE = Path(__file__).resolve().parents[3] / "config" / "cartesian.yaml"
GRID_S = 1e-3
TIP_MM, ENCODER_MM, FORCE_N, HEAT_K = 0.003, 0.0005, 1.0, 0.05


@dataclass
class Axes:
    """Channels of a run at times (n,) s of the common clock, every GRID_S: encoders, tips (n, 3) mm, drives (n, 3) N, heat (n,) deg C."""

    encoder: np.ndarray
    tip: np.ndarray
    drive: np.ndarray | None = None
    heat: np.ndarray | None = None


def experiment(
    folder: Path,
    runs: Sequence[tuple[str, float]],
    moved: Callable[[np.ndarray, np.ndarray], Axes],
    every: int = 50,
) -> Path:
    """Writes programs, logs and experiment.yaml; the path of the latter.

    runs: moves of a program and when it started, s; moved: common times (n,) and set-points (n, 3) -> what happens; every: how
    many milliseconds between rows.
    """
    rng, text = np.random.default_rng(4), f"config: [{MACHINE}, air.yaml]\nruns:\n"
    (folder / "air.yaml").write_text("process: {force: {model: none}}\n")
    for k, (moves, started) in enumerate(runs):
        program = f"G21 G90 G17 G94\n{moves}M2\n"
        line = Timeline(read(program))
        t = np.arange(0.0, line.log_end, GRID_S)
        seen = line.sample(t)
        it = moved(started + t, seen["tip"])
        rows = slice(0, None, every)
        columns = {"t_s": t, "line": seen["line"]}
        noisy = {"{}_mm": (it.tip, TIP_MM), "cmd_{}_mm": (seen["tip"], 0.0), "act_{}_mm": (it.encoder, ENCODER_MM)}
        if it.drive is not None:
            noisy["act_{}_N"] = (it.drive, FORCE_N)
        for name, (values, sd) in noisy.items():
            columns |= {name.format(a): values[:, i] + rng.normal(0.0, sd, len(t)) for i, a in enumerate("xyz")}
        if it.heat is not None:
            columns["temp_C"] = it.heat + rng.normal(0.0, HEAT_K, len(t))
        table = np.column_stack(list(columns.values()))[rows]
        np.savetxt(folder / f"{k}.csv", table, fmt="%.6f", delimiter=",", header=",".join(columns), comments="")
        (folder / f"{k}.nc").write_text(program)
        text += f"  - {{name: run-{k}, program: {k}.nc, log: {k}.csv, cutting: false, started_s: {started}}}\n"
    (folder / "experiment.yaml").write_text(text)
    return folder / "experiment.yaml"
