"""The plainest experiment, with every effect of the library on every shipped machine: `camcomp simulate` and a little noise.

What it tries is the plumbing, the library and the gate, not physics: the model itself writes the logs here (truth plants
are in tests/validation/recorded and tests/validation/plants).  Tip: 3 um of white noise per axis; encoders: rounded to 0.5 um, or as much at the
reach of an arm.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tests.validation import runner

HEAD = "G21 G90 G17 G94\nS18000 M3\n"
PROGRAMS = {
    "left": f"{HEAD}G0 X10 Y0 Z5\nG1 Z0 F300\nG3 X10 Y0 I-10 J0 F1200\nG0 Z5\nM5\nM30\n",
    "right": f"{HEAD}G0 X10 Y0 Z5\nG1 Z0 F300\nG2 X10 Y0 I-10 J0 F900\nG0 Z5\nM5\nM30\n",
    "ramps": f"{HEAD}G0 X-12 Y-8 Z9\nG1 X12 Y-4 Z0 F1500\nG1 Y6 Z2\nG1 X-12 Y8 Z-3\nG1 Y-8 Z4\nG0 Z9\nM5\nM30\n",
}
AIR = "ramps"
BEGINS_S = {"left": 0, "right": 900, "ramps": 2400}  # on the common clock
TIP_MM = 0.003
ENCODER = {"mm": 5e-4, "rad": 2e-7}
STEP_S = 0.03
FINE_S = {"servo_overshoot": 0.015, "speed_limit": 0.01}  # rings, or begins, within some rows
CONTROL = {"inertia": {"acceleration_mm_per_s2": 60.0}}  # else over within one row


@dataclass(frozen=True)
class Fault:
    """One entry under `effects:`."""

    effect: str
    target: str | None
    parameters: dict[str, object] = field(hash=False)

    def entry(self) -> dict[str, object]:
        """As it stands in YAML."""
        return {"effect": self.effect, **({"target": self.target} if self.target else {}), **self.parameters}


def logged(folder: Path, machine: str, fault: Fault | None) -> dict[str, Path]:
    """Logs without noise of all programs, by their names."""
    config, wrong = runner.ROOT / "config" / f"{machine}.yaml", folder / "wrong.yaml"
    wrong.write_text(
        json.dumps(
            {"effects": [fault.entry()] if fault else [], "control": CONTROL.get(fault.effect, {}) if fault else {}}
        )
    )
    logs = {}
    for name, program in PROGRAMS.items():
        source, logs[name] = folder / f"{name}.nc", folder / f"{name}.csv"
        source.write_text(program)
        arguments = ["simulate", str(source), "--config", str(config), "--config", str(wrong), "-o", str(logs[name])]
        step = STEP_S if fault is None else FINE_S.get(fault.effect, STEP_S)
        arguments += ["--step-s", str(step), "--started-s", str(BEGINS_S[name]), *(["--air"] if name == AIR else [])]
        code, said = runner.invoke(arguments)
        assert code == 0, said
    return logs


def experiment(folder: Path, machine: str, fault: Fault | None, seed: int = 7) -> Path:
    """An experiment of all programs on the shipped machine with that fault; its path."""
    rng, runs = np.random.default_rng(seed), []
    for name, log in logged(folder, machine, fault).items():
        blur(log, rng)
        runs.append(
            {
                "name": name,
                "program": f"{name}.nc",
                "log": log.name,
                "cutting": name != AIR,
                "started_s": BEGINS_S[name],
            }
        )
    path = folder / "experiment.yaml"
    path.write_text(json.dumps({"config": [str(runner.ROOT / "config" / f"{machine}.yaml")], "runs": runs}))
    return path


def blur(log: Path, rng: np.random.Generator) -> None:
    """Puts noise on the tip and rounds the encoders of a log."""
    header, table = read(log)
    for i, name in enumerate(header):
        step = ENCODER.get(name.rpartition("_")[2]) if name.startswith("act_") else None
        if name in ("x_mm", "y_mm", "z_mm"):
            table[:, i] += rng.normal(0, TIP_MM, len(table))
        elif step:
            table[:, i] = np.round(table[:, i] / step) * step
    np.savetxt(log, table, fmt="%.7f", delimiter=",", header=",".join(header), comments="")


def read(log: Path) -> tuple[list[str], np.ndarray]:
    """Names of the columns of a log, and its rows."""
    return log.read_text().partition("\n")[0].split(","), np.loadtxt(log, delimiter=",", skiprows=1)
