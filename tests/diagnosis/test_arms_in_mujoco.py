"""An arm in MuJoCo: a pedestal that gives way and a link that grows are named with their size; what no library lists is no
library cause for certain.
"""

import csv
import inspect
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


def pedestal_or_link(rad_per_Nm=0.0, growth_mm_per_K=0.0):
    """Tip by time and joints; the link warms by 10 K with 1100 s."""

    def tip(t, q):
        warm = 10.0 * (1.0 - np.exp(-t / 1100.0))
        return mujoco_arm.settle(mujoco_arm.arm(growth_mm_per_K * warm), q, rad_per_Nm)

    return tip


def unlisted(name):
    """Tip by time and joints of an arm with something that no library lists."""
    model, liquid = mujoco_arm.arm(), None

    def tip(t, q):
        nonlocal liquid
        told = q
        if name == "hose":
            told = q + mujoco_arm.hose(q)
        elif name == "bent_upper_arm":
            told = q + mujoco_arm.bent_upper_arm(model, q)
        elif name == "sloshing":
            more, liquid = mujoco_arm.sloshing(q, q if liquid is None else liquid)
            told = q + more
        at = mujoco_arm.settled(model, told)
        place = 1e3 * at.site_xpos[0]
        if name == "growing_spindle":
            return place + mujoco_arm.growing_spindle(at.site_xmat[0].reshape(3, 3)[:, 2], t)
        if name == "soft_floor":
            return place + mujoco_arm.soft_floor(q, place)
        return place + mujoco_arm.wobbling_bearing(q) if name == "wobbling_bearing" else place

    return tip


def experiment(folder, tip_at):
    """Set-points of `simulate`, tips of MuJoCo with 3 um of noise."""
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
            q = np.array([float(row[f"cmd_A{k}_rad"]) for k in range(1, 7)])
            tip = tip_at(started + float(row["t_s"]), q)
            row |= dict(zip(("x_mm", "y_mm", "z_mm"), tip - ORIGIN + 0.003 * rng.standard_normal(3), strict=True))
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
    result = runner.ask(experiment(tmp_path, pedestal_or_link(**fault)), (effect,))
    assert result["verdict"] in ("ambiguous", "unknown")
    assert all(each["probability"] <= 0.8 for each in result["causes"] if each["effect"] != "unknown")


def grown(growth_mm_per_K, warm_up_s):
    """Lengthening (3,) per kelvin at the starts of runs and 2500 s: a curve of three points fixes no growth and time by themselves."""
    return growth_mm_per_K * -np.expm1(-np.array([900.0, 2400.0, 2500.0]) / warm_up_s)


@pytest.mark.parametrize(
    ("fault", "effect", "target", "size", "want"),
    [
        ({"rad_per_Nm": 1e-7}, "base_compliance", None, lambda rad_per_Nmm, rad_per_N: [rad_per_Nmm, rad_per_N], [1e-10, 4e-8]),
        ({"growth_mm_per_K": 0.006}, "link_growth", "A2", grown, grown(0.006, 1100.0)),
    ],
)  # fmt: skip
def test_it_is_named_with_its_size(tmp_path, fault, effect, target, size, want):
    result = runner.ask(experiment(tmp_path, pedestal_or_link(**fault)))
    (cause,) = (each for each in result["causes"] if each["probability"] > 0.5)
    assert result["verdict"] == "identified"
    assert (cause["effect"], cause["target"]) == (effect, target)
    found = {name: cause["parameters"][name]["value"] for name in inspect.signature(size).parameters}
    assert size(**found) == pytest.approx(want, rel=0.1, abs=0.0)


UNLISTED = ("hose", "bent_upper_arm", "growing_spindle", "soft_floor", "wobbling_bearing", "sloshing")


@pytest.mark.parametrize("name", UNLISTED)
def test_what_no_library_lists_is_no_cause_of_the_library_for_certain(tmp_path, name):
    result = runner.ask(experiment(tmp_path, unlisted(name)))
    assert result["verdict"] == "unknown"
    assert all(each["probability"] <= 0.8 for each in result["causes"] if each["effect"] != "unknown")


def test_an_arm_with_nothing_wrong_has_none(tmp_path):
    assert runner.ask(experiment(tmp_path, unlisted(None)))["verdict"] == "none"
