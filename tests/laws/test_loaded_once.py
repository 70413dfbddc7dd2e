"""A command reads and checks every machine file and experiment file once, whatever outputs are asked for."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from camcomp.model.config import load
from camcomp.terminal.cli import main

ROOT = Path(__file__).parents[2]
MACHINE, PROGRAM = str(ROOT / "config/cartesian.yaml"), str(ROOT / "samples/groove-circle-2.nc")


@pytest.fixture
def loaded(tmp_path, monkeypatch):
    """Function that runs a command line in a folder of its own and returns how often each YAML file was loaded."""
    monkeypatch.chdir(tmp_path)
    count = Counter()
    read = load._read_texts

    def counted(paths):
        count.update(Path(each).name for each in paths)
        return read(paths)

    def run(*words):
        count.clear()
        with pytest.raises(SystemExit) as done:
            main(list(words))
        assert done.value.code in (0, None)
        return dict(count)

    monkeypatch.setattr(load, "_read_texts", counted)
    return run


def test_commands_on_a_program_load_the_machine_once(loaded):
    once = {"cartesian.yaml": 1}
    config = ("--config", MACHINE)
    assert loaded("compensate", PROGRAM, *config, "-o", "out.nc", "--joints", "out.csv", "--paths", "paths.csv") == once
    assert loaded("verify", "out.nc", "--against", PROGRAM, *config, "--json", "verify.json") == once
    assert loaded("simulate", PROGRAM, *config, "-o", "log.csv", "--step-s", "0.5") == once
    assert loaded("batch", PROGRAM, *config, "--output-dir", "out", "--jobs", "1") == once
    assert loaded("validate", PROGRAM, MACHINE) == once


def test_a_diagnosis_with_all_outputs_loads_experiment_and_machine_once(loaded):
    time = np.arange(0.0, 20.0, 0.05)
    for name, phase in (("a", 0.0), ("b", 1.0)):
        x = 20.0 * np.sin(0.2 * np.pi * time + phase)
        late = x - 0.005 * np.gradient(x, time)
        rows = "".join(f"{t:.3f},{c:.6f},{a:.6f}\n" for t, c, a in zip(time, x, late, strict=True))
        Path(f"{name}.csv").write_text(f"t_s,cmd_x_mm,act_x_mm\n{rows}")
    runs = "".join(f"- {{name: {each}, log: {each}.csv, cutting: false, started_s: 0}}\n" for each in "ab")
    Path("experiment.yaml").write_text(f"config: [{MACHINE}]\nruns:\n{runs}")
    outputs = ("--json", "d.json", "--report", "d.html", "--write-config", "better.yaml", "--residuals", "rest.csv")
    found = loaded("diagnose", "experiment.yaml", *outputs, "--library", "laws", "--quiet")
    assert found == {"experiment.yaml": 1, "cartesian.yaml": 1}
