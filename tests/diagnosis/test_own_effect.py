"""An effect of a user's own, in one file, announced by an entry point: listed, fitted, and compensated like ours."""

import json
import sys

import numpy as np
import pytest

from tests.installed import install
from tests.validation import runner
from tests.validation.plants import designs

SOURCE = '''
"""The ram is wavy: the tip sways along machine x with the height at which it works."""

import numpy as np

from camcomp.model.effect import Parameter

STAGE = "tool"
TARGET = "machine"
SOURCE = "definition"
PARAMETERS = (
    Parameter("wave_mm", "mm", 0.0, -1.0, 1.0, 0.02, 2e-5, "rams are straight to 2 to 50 um"),
)


def on_pose(tip, load, motion, p):
    """Tip (n, 3), machine frame."""
    wave = p["wave_mm"]
    return tip if wave == 0.0 else tip + wave * np.sin(0.6 * (tip[:, 2:3] + 173.0)) * np.array([1.0, 0.0, 0.0])
'''
WAVE = 0.03


@pytest.fixture
def own(tmp_path, monkeypatch):
    """The user's package is installed."""
    install(tmp_path, "effects", "wavy_ram", SOURCE)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield
    sys.modules.pop("wavy_ram", None)


def slope(feed):
    """A square whose corners lie at two heights."""
    lines = ["G21 G90 G17 G54", "G0 X-20 Y-20 Z0"]
    lines += [f"G1 X20 Z15 F{feed}", f"G1 Y20 Z0 F{feed}", f"G1 X-20 Z15 F{feed}", f"G1 Y-20 Z0 F{feed}", "M2"]
    return "\n".join(lines) + "\n"


def test_it_is_listed_fitted_and_compensated(own, tmp_path):
    code, said = runner.invoke(["effects", "--json"])
    assert code == 0
    [mine] = [e for e in json.loads(said) if e["effect"] == "wavy_ram"]
    assert mine["stage"] == "tool" and mine["parameters"][0]["name"] == "wave_mm"
    # the machine that has it, with the tracker's noise
    wavy = tmp_path / "wavy.yaml"
    wavy.write_text(f"effects: [{{effect: wavy_ram, wave_mm: {WAVE}}}]\n")
    runs = {"slope": slope(900), "fast": slope(2400), "circle": designs.circle(20.0, 900.0, True, plunge=False)}
    rng = np.random.default_rng(3)
    text = f"config: [{runner.CONFIG}]\nruns:\n"
    for k, (name, program) in enumerate(runs.items()):
        nc, log = tmp_path / f"{name}.nc", tmp_path / f"{name}.csv"
        nc.write_text(program)
        line = ["simulate", str(nc), "--config", str(runner.CONFIG), "--config", str(wavy), "--step-s", "0.06"]
        code, said = runner.invoke([*line, "-o", str(log)])
        assert code == 0, said
        head, *rows = log.read_text().splitlines()
        values = np.array([[float(v) for v in row.split(",")] for row in rows])
        values[:, 2:5] += 0.0015 * rng.standard_normal((len(values), 3))
        values[:, 8:11] += 0.0005 * rng.standard_normal((len(values), 3))
        values[:, 11:17] += rng.standard_normal((len(values), 6))
        log.write_text(head + "\n" + "\n".join(",".join(f"{v:.5f}" for v in row) for row in values) + "\n")
        text += f"  - {{name: {name}, program: {name}.nc, log: {name}.csv, cutting: true, started_s: {100 * k}}}\n"
    (tmp_path / "experiment.yaml").write_text(text)
    out, better = tmp_path / "result.json", tmp_path / "better.yaml"
    code, said = runner.invoke(
        ["diagnose", str(tmp_path / "experiment.yaml"), "--json", str(out), "--write-config", str(better)]
    )
    assert code == 0, said
    result = json.loads(out.read_text())
    assert [(c["effect"], c["target"]) for c in result["causes"]] == [("wavy_ram", None)]
    assert result["causes"][0]["parameters"]["wave_mm"]["value"] == pytest.approx(WAVE, rel=0.03)
    # the program corrected with what was found is right on the machine that has it, and the plain one is not
    corrected = tmp_path / "corrected.nc"
    code, said = runner.invoke(
        ["compensate", str(tmp_path / "slope.nc"), "--config", str(better), "-o", str(corrected)]
    )
    assert code == 0, said
    truth = ["--config", str(runner.CONFIG), "--config", str(wavy)]
    line = ["verify", str(corrected), "--against", str(tmp_path / "slope.nc"), *truth, "--tolerance-um", "5"]
    code, said = runner.invoke(line)
    assert code == 0, said
    code, said = runner.invoke(
        ["compensate", str(tmp_path / "slope.nc"), "--config", str(runner.CONFIG), "-o", str(corrected)]
    )
    assert code == 0, said
    assert runner.invoke(line)[0] == 1
