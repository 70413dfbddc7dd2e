"""A pedestal that gives way and a link that grows, on an arm in MuJoCo: named with their size, and with them alone."""

import csv
import json

import numpy as np
import pytest

from tests.validation import runner

pytestmark = pytest.mark.ecosystem
pytest.importorskip("mujoco")
from tests.validation.plants import mujoco_arm

HEAD = "G21 G90 G17 G94\nS18000 M3\n"
PROGRAMS = {
    "circle": (0.0, f"{HEAD}G0 X150 Y0 Z40\nG1 Z0 F3000\nG3 X150 Y0 I-150 J0 F9000\nG0 Z40\nM5\nM30\n"),
    "frame": (900.0, f"{HEAD}G0 X-200 Y-250 Z90\nG1 X250 Y-50 Z0 F9000\nG1 Y200 Z120\nG1 X-200 Y250 Z-60\nG1 Y-250 Z90\nM5\nM30\n"),
    "ways": (2400.0, f"{HEAD}G0 X0 Y0 Z40\nG1 X250 Y250 Z0 F8000\nG1 X-250 Y-150 Z200\nG1 X100 Y-250 Z50\nM5\nM30\n"),
}  # fmt: skip
ORIGIN = np.array([1550.0, 0.0, 800.0])  # of the program in the machine file
CONFIG = str(runner.ROOT / "config" / "kuka-kr210.yaml")


def experiment(folder, rad_per_Nm=0.0, growth_mm_per_K=0.0):
    """Set-points of `simulate`, tips of MuJoCo with 3 um of noise; the link warms by 10 K with 1100 s."""
    rng, runs = np.random.default_rng(3), []
    for name, (started, text) in PROGRAMS.items():
        program, log = folder / f"{name}.nc", folder / f"{name}.csv"
        program.write_text(text)
        asked = [
            "simulate",
            str(program),
            "--config",
            CONFIG,
            "-o",
            str(log),
            "--step-s",
            "0.05",
            "--started-s",
            str(started),
        ]
        code, said = runner.invoke([*asked, "--air"])
        assert code == 0, said
        rows = list(csv.DictReader(log.read_text().splitlines()))
        for row in rows:
            warm = 10.0 * (1.0 - np.exp(-(started + float(row["t_s"])) / 1100.0))
            q = np.array([float(row[f"cmd_A{k}_rad"]) for k in range(1, 7)])
            tip = mujoco_arm.settle(mujoco_arm.arm(growth_mm_per_K * warm), q, rad_per_Nm) - ORIGIN
            row |= dict(zip(("x_mm", "y_mm", "z_mm"), tip + 0.003 * rng.standard_normal(3), strict=True))
        kept = [key for key in rows[0] if not key.endswith(("_N", "_Nmm"))]
        with log.open("w", newline="") as file:
            out = csv.DictWriter(file, kept, extrasaction="ignore")
            out.writeheader()
            out.writerows(rows)
        runs.append({"name": name, "program": program.name, "log": log.name, "cutting": False, "started_s": started})
    path = folder / "experiment.yaml"
    path.write_text(json.dumps({"config": [CONFIG], "runs": runs}))
    return path


@pytest.mark.parametrize(
    ("fault", "effect"), [({"rad_per_Nm": 1e-7}, "base_compliance"), ({"growth_mm_per_K": 0.006}, "link_growth")]
)
def test_a_library_without_it_names_no_other_cause_for_certain(tmp_path, fault, effect):
    result = runner.ask(experiment(tmp_path, **fault), (effect,))
    assert result["verdict"] in ("ambiguous", "unknown")
    assert all(each["probability"] <= 0.8 for each in result["causes"] if each["effect"] != "unknown")


@pytest.mark.parametrize(
    ("fault", "effect", "target", "want"),
    [
        ({"rad_per_Nm": 1e-7}, "base_compliance", None, {"rad_per_Nmm": 1e-10, "rad_per_N": 4e-8}),
        ({"growth_mm_per_K": 0.006}, "link_growth", "A2", {"growth_mm_per_K": 0.006}),
    ],
)
def test_it_is_named_with_its_size(tmp_path, fault, effect, target, want):
    result = runner.ask(experiment(tmp_path, **fault))
    (cause,) = (each for each in result["causes"] if each["probability"] > 0.5)
    assert result["verdict"] == "identified"
    assert (cause["effect"], cause["target"]) == (effect, target)
    for name, value in want.items():
        assert cause["parameters"][name]["value"] == pytest.approx(value, rel=0.1)
