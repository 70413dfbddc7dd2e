"""A measured ball-screw axis (EMPS benchmark). The data may not travel: CAMCOMP_DATA says where they are."""

import json
import os
import re
from pathlib import Path

import pytest
import yaml

from tests.commandline import camcomp, table

FILE = Path(os.environ.get("CAMCOMP_DATA", "/nowhere")) / "emps" / "DATA_EMPS.mat"
pytestmark = pytest.mark.skipif(not FILE.is_file(), reason="the recording is not here: CAMCOMP_DATA")


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("emps")
    done = camcomp("import", FILE, "--config", "config/cartesian.yaml", "-o", folder / "x")
    assert done.returncode == 0, done.stderr.decode()
    log = table(folder / "x" / "DATA_EMPS.csv")
    assert len(log["t_s"]) == 24841
    assert list(log) == ["t_s", "cmd_x_mm", "act_x_mm", "act_x_N"]
    done = camcomp(
        "diagnose", folder / "x" / "experiment.yaml", "--json", folder / "o.json", "--library", folder / "learned",
        "--write-config", folder / "better.yaml",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr.decode()
    (entry,) = [e for e in yaml.safe_load((folder / "better.yaml").read_text())["effects"] if e["effect"] == "formula"]
    assert (entry["stage"], entry["target"]) == ("control", "x")
    return json.loads((folder / "o.json").read_text())


def cause(result, name):
    return next(c for c in result["causes"] if c["effect"] == name)


def test_servo_lag_is_that_of_the_known_controller(result):
    theory = 1e3 * (1.0 + 203.5 / (35.15065188 * 243.45)) / 160.18
    lag = cause(result, "servo_lag")["parameters"]["time_constant_ms"]
    assert lag["value"] == pytest.approx(theory, rel=0.02)
    assert lag["ci95"][0] < theory < lag["ci95"][1]


def test_friction_with_its_asymmetry(result):
    found = cause(result, "friction")
    assert found["target"] == "x"
    assert found["parameters"]["force_N"]["value"] == pytest.approx(20.4, rel=0.05)
    assert found["parameters"]["viscous_Ns_per_mm"]["value"] == pytest.approx(0.2035, rel=0.05)
    assert found["parameters"]["asymmetry_Ns_per_mm"]["ci95"][1] < -0.02
    assert result["axes_in_detail"]["x"]["force"]["mass_kg"]["value"] == pytest.approx(95.1, rel=0.03)


def test_no_spring_and_no_cubic_are_made_up(result):
    assert {c["effect"] for c in result["causes"]} == {"servo_lag", "servo_overshoot", "friction", "unknown"}


def test_the_loop_swings_as_the_known_controller_does(result):
    """M x'' = K (kp (c - x) - x') - F x': damping 1 / (2 T w), w^2 = kp g / T, T = M / (K + F), g = K / (K + F)."""
    by_speed, mass, viscous, kp = 35.15065188 * 243.45, 95.1, 203.5, 160.18
    time = mass / (by_speed + viscous)
    w = (kp * by_speed / (by_speed + viscous) / time) ** 0.5
    found = cause(result, "servo_overshoot")["parameters"]
    assert found["period_ms"]["value"] == pytest.approx(2e3 * 3.141592653589793 / w, rel=0.06)
    low, high = found["damping"]["ci95"]
    assert low < 1.0 / (2.0 * time * w) < high


def test_ripple_of_the_screw_is_located_in_the_drive_force(result):
    line = result["where"]["drivers"][0]
    assert line["covariate"] == "position:x" and line["channel"] == "act_x_N"
    assert line["period_mm"] == pytest.approx(2.50, rel=0.004)
    assert 0.8 < line["forward_N"] < 1.4 and 0.8 < line["backward_N"] < 1.4
    assert result["verdict"] == "unknown"


def test_the_ripple_is_a_law_of_the_drive_force_alone(result):
    """The loop answers 1 N at 2.5 mm by 0.8 um up to 50 mm/s and by 0.1 um at 125 mm/s: by no function of the position alone."""
    law = cause(result, "unknown")["law"]
    periods = {float(each) for each in re.findall(r"act_mm/([\d.]+)", law["formula"])}
    assert all(each == pytest.approx(2.50, rel=0.004) for each in periods)
    force = [each["value"] for each in law["terms"] if each["term"].startswith("force x") and each["unit"] == "N"]
    assert len(force) == len(law["terms"]) in (2, 4)  # of both directions in common, or of each
    assert all(0.8 < (a * a + b * b) ** 0.5 < 1.4 for a, b in zip(force[::2], force[1::2], strict=True))


def test_presliding_is_no_step(result):
    turn = cause(result, "friction")["parameters"]["presliding_mm"]
    assert turn["ci95"][0] > 1e-4  # the step is among what was tried
    assert 0.002 <= turn["value"] <= 0.02
