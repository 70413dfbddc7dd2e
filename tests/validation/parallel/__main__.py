"""Command line: `python -m tests.validation.parallel --out DIR --count N --seed S [--machine NAME]`."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import yaml

from tests.validation.parallel import sensors
from tests.validation.parallel.machine import read
from tests.validation.parallel.scenario import CHANNELS, KINDS, MESSES, Impossible, Scenario, fill, runs, times
from tests.validation.writing import write_all

MACHINES = ("orthoglide", "delta", "puu")


def scenario(seed: int, machine_name: str | None) -> Scenario:
    """The experiment of a seed; draws again what cannot be."""
    for attempt in range(40):
        rng = np.random.default_rng([seed, attempt])
        name = machine_name or str(rng.choice(MACHINES, p=[0.45, 0.35, 0.2]))
        kind = str(np.random.default_rng([seed, 7]).choice(list(KINDS), p=list(KINDS.values())))
        machine = read(name)
        channels = "all" if rng.random() < 0.5 else str(rng.choice(CHANNELS))
        mess = str(rng.choice(MESSES)) if rng.random() < 0.5 else None
        warming = {"rise_K": float(rng.uniform(3, 12)), "warm_up_s": float(np.round(rng.uniform(300, 1500)))}
        tracks = runs(rng, machine, warming)
        keep = True if mess == "idle_kept" else bool(rng.random() < 0.5)
        rows = times(rng, tracks, keep)
        if sum(map(len, rows)) > 6000:
            continue
        instruments = sensors.draw(rng, mess)
        s = Scenario(seed, kind, machine, channels, mess, instruments, tracks, rows, warming)
        s.noise_mm = sensors.expected_noise(instruments)
        try:
            fill(rng, s)
        except Impossible:
            continue
        return s
    raise RuntimeError(f"seed {seed}: nothing fits")


def write(seed: int, out: Path, machine_name: str | None) -> str:
    """One experiment with its sealed answer; a line about it."""
    s = scenario(seed, machine_name)
    folder = out / f"e-{seed}"
    if folder.exists():
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    logs, noise = sensors.logs(np.random.default_rng([seed, 99]), s)
    for cause in s.sizes:  # against the noise as it came out
        for key in ("ratio", "left_ratio"):
            if key in cause:
                cause[key] *= s.noise_mm / noise
    entries = []
    for k, (run, text) in enumerate(zip(s.tracks, logs, strict=True), 1):
        (folder / f"program-{k}.nc").write_text(run.program)
        (folder / f"log-{k}.csv").write_text(text)
        entries.append({"name": f"run-{k}", "program": f"program-{k}.nc", "log": f"log-{k}.csv",
                        "cutting": run.cutting, "started_s": run.started_s})  # fmt: skip
    experiment: dict = {"config": [str(s.machine.file)], "runs": entries}
    if s.sensors["stated"]:
        experiment["sd"] = s.sensors["stated"]
    (folder / "experiment.yaml").write_text(yaml.safe_dump(experiment, sort_keys=False))
    truth = {
        "seed": seed, "kind": s.kind, "machine": s.machine.name, "channels": s.channels, "mess": s.mess,
        "noise_um": noise * 1e3, "small_um": s.small_mm * 1e3, "causes": s.sizes,
        "small": [{"effect": d.effect, "target": d.target, "parameters": d.parameters} for d in s.small],
        "sensors": s.sensors, "warming": s.warming, "ripple": s.ripple,
        "link_scatter": None if s.scatter is None else s.scatter.tolist(),
        "recordings": [run.name for run in s.tracks], "rows": [len(t) for t in s.rows],
    }  # fmt: skip
    (out / "truth").mkdir(exist_ok=True)
    (out / "truth" / f"e-{seed}.json").write_text(json.dumps(truth, indent=1) + "\n")
    named = ", ".join(f"{c['effect']}:{c['target']} {c['ratio']:.1f}" for c in s.sizes)
    return f"e-{seed} {s.machine.name} {s.kind} {s.channels} {s.mess} noise {noise * 1e3:.1f} um; {named}"


if __name__ == "__main__":
    write_all("tests.validation.parallel", write, "--machine", MACHINES)
