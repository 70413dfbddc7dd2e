"""Squareness: sign and size by definition, the ball-bar's circle in closed form, circles of a program made round again."""

import json

import numpy as np
import pytest

from camcomp.ground import shelf
from camcomp.model.effect import Axes
from tests.validation import runner
from tests.validation.plants.guideways import PROGRAMS, Guideways, experiment

RADIUS = 40.0


def bent(tip, target, angle_mrad):
    """The hook at a program whose origin lies at (100, 200, 300)."""
    none = np.zeros_like(tip)
    axes = Axes(tip - [100.0, 200.0, 300.0], tip, none, np.zeros((len(tip), 3, 3)))
    return shelf.load("effects", "squareness").on_guideway(tip, axes, target, {"angle_mrad": angle_mrad})


@pytest.mark.parametrize(("target", "moved"), [("xy", [0.04, 0, 0]), ("xz", [0.06, 0, 0]), ("yz", [0, 0.06, 0])])
def test_the_first_axis_moves_with_the_second_from_the_programs_origin_on(target, moved):
    tip = np.array([[110.0, 220.0, 330.0], [100.0, 200.0, 300.0]])
    got = bent(tip, target, 2.0) - tip
    assert got[0] == pytest.approx(moved, abs=1e-12) and not got[1].any()


def simulated(tmp_path, program, effect):
    """Tips (n, 3) that the modelled Cartesian machine logs without a cutting force."""
    (tmp_path / "in.nc").write_text(program)
    (tmp_path / "effects.yaml").write_text(f"effects: [{effect}]\nprocess: {{force: {{model: none}}}}\n")
    files = ["--config", str(runner.ROOT / "config/cartesian.yaml"), "--config", str(tmp_path / "effects.yaml")]
    code, said = runner.invoke(["simulate", str(tmp_path / "in.nc"), *files, "-o", str(tmp_path / "log.csv")])
    assert code == 0, said
    return np.loadtxt(tmp_path / "log.csv", delimiter=",", skiprows=1)[:, 2:5]


@pytest.mark.parametrize("program", ["left", "right"])
def test_a_ball_bar_reads_it_from_the_radii_at_45_degrees(tmp_path, program):
    """r(phi) = R + R/2 angle sin 2 phi, in both directions: radii on the diagonals differ by R times the angle."""
    tip = simulated(tmp_path, PROGRAMS[program], "{effect: squareness, target: xy, angle_mrad: 0.8}")
    phi, r = np.arctan2(tip[:, 1], tip[:, 0]), np.hypot(tip[:, 0], tip[:, 1])
    radius = RADIUS if program == "left" else 30.0
    assert np.abs(r - radius - 0.4e-3 * radius * np.sin(2 * phi)).max() < 1e-4  # the log itself is good to 0.1 um
    diagonal = np.abs(np.abs(phi) % (np.pi / 2) - np.pi / 4) < 0.05
    up = (np.sin(2 * phi) > 0) & diagonal
    assert r[up].mean() - r[diagonal & ~up].mean() == pytest.approx(0.8e-3 * radius, rel=5e-3)


@pytest.mark.campaign  # test_every_machine has one in the plain run
def test_it_is_found_on_a_machine_that_leans_and_its_circles_come_out_round(tmp_path):
    machine = Guideways({("x", "y"): 0.7e-3}, tool=60.0)
    path, better = experiment(tmp_path, machine), tmp_path / "better.yaml"
    code, said = runner.invoke(
        ["diagnose", str(path), "--json", str(tmp_path / "r.json"), "--write-config", str(better)]
    )
    assert code == 0, said
    result = json.loads((tmp_path / "r.json").read_text())
    [cause] = result["causes"]
    assert (result["verdict"], cause["effect"], cause["target"]) == ("identified", "squareness", "xy")
    low, high = cause["parameters"]["angle_mrad"]["ci95"]
    assert low < 0.7 < high and high - low < 0.1
    source, out = tmp_path / "left.nc", tmp_path / "out.nc"
    files = [each for name in (better, tmp_path / "tool.yaml") for each in ("--config", str(name))]
    code, said = runner.invoke(["compensate", str(source), *files, "-o", str(out)])
    assert code == 0, said
    assert out_of_round(machine, source.read_text()) > 0.027
    assert out_of_round(machine, out.read_text()) < 0.0025  # chords and what noise does to the angle


def out_of_round(machine, program):
    """Largest minus smallest radius of the circle that the machine drives, mm."""
    return float(np.ptp(np.hypot(*machine.drive(program)[:, :2].T)))
