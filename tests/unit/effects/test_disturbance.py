"""A disturbance for a while: sign, size and time by definition, found and located on a plant, the corrected program."""

import json
from dataclasses import replace

import numpy as np
import pytest

from camcomp.ground import shelf
from camcomp.model.effect import Motion
from tests.validation import runner
from tests.validation.plants.guideways import Guideways, experiment
from tests.validation.plants.motion import Timeline, read
from tests.validation.plants.slides import Axes
from tests.validation.plants.slides import experiment as slides

EFFECT = shelf.load("effects", "disturbance")


def standing(n=401):
    """One standing actuator for 4 s from 100 s of the common clock on."""
    t = np.linspace(0.0, 4.0, n)
    zero = np.zeros((n, 1))
    return Motion(
        time=t,
        common=100.0 + t,
        cut_min=t / 60.0,
        temperature=None,
        encoder=zero,
        speed=zero,
        direction=zero,
        home=np.zeros(1),
        stiffness=np.array([2e4]),
    )


def test_it_shifts_the_carriage_and_the_drive_holds_against_a_force():
    m, p = standing(), {"shift_mm": 0.02, "force_N": 100.0, "from_s": 101.0, "to_s": 102.0}
    error = EFFECT.on_drive(np.zeros((401, 1)), m, np.ones(1), p)[:, 0]
    effort = EFFECT.on_drive_force(np.zeros((401, 1)), m, np.ones(1), p)[:, 0]
    inside = (m.common > 101.03) & (m.common < 101.97)
    outside = (m.common < 101.0) | (m.common > 102.0)
    assert error[inside] == pytest.approx(0.02 + 100.0 / 2e4) and not error[outside].any()
    assert effort[inside] == pytest.approx(-100.0) and not effort[outside].any()


def test_an_interval_of_no_length_is_none():
    p = {"shift_mm": 0.02, "force_N": 100.0, "from_s": 101.0, "to_s": 101.0}
    m = replace(standing())
    error = np.zeros((401, 1))
    assert EFFECT.on_drive(error, m, np.ones(1), p) is error and EFFECT.on_drive_force(error, m, np.ones(1), p) is error


@pytest.mark.campaign  # test_every_machine has one in the plain run
def test_it_is_found_and_located_in_time(tmp_path):
    """The plant lifts y by 25 um from second 203 of the common clock on, for 1.5 s: within the third run."""

    def pushed(common):
        return 0.025 * ((common >= 203.0) & (common < 204.5))[:, None] * np.array([0.0, 1.0, 0.0])

    path = experiment(tmp_path, Guideways(tool=60.0), beside=pushed)
    result = runner.ask(path)
    [cause] = result["causes"]
    assert (result["verdict"], cause["effect"], cause["target"]) == ("identified", "disturbance", "y")
    found = cause["parameters"]
    assert "force_N" not in found, "without the force of the drives a force is a shift"
    for name, value in (("shift_mm", 0.025), ("from_s", 203.0), ("to_s", 204.5)):
        low, high = found[name]["ci95"]
        assert low <= value <= high
    known = tmp_path / "known.yaml"
    values = {name: each["value"] for name, each in found.items()}
    known.write_text(json.dumps({"effects": [{"effect": "disturbance", "target": "y", **values}]}))
    text = path.read_text().replace("tool.yaml]", "tool.yaml, known.yaml]")
    path.write_text(text)
    assert runner.ask(path)["verdict"] == "none"


def test_a_push_is_a_force_where_drives_log_theirs(tmp_path):
    """300 N push y along + for a second of the second run: 15 um through its spring, and the drive holds against them."""
    moves = "G0 X0 Y0 Z0\nG1 X40 F900\nY25\nX0 Y5\nY0\n"

    def moved(common, asked):
        here = np.clip(np.minimum(common - 103.0, 104.0 - common) / 0.004, 0.0, 1.0)[:, None]
        return Axes(asked, asked + here * [0.0, 0.015, 0.0], here * [0.0, -300.0, 0.0])

    result = runner.ask(slides(tmp_path, [(moves, 0.0), (moves, 100.0), (moves, 200.0)], moved))
    [cause] = result["causes"]
    assert (result["verdict"], cause["effect"], cause["target"]) == ("identified", "disturbance", "y")
    for name, value in (("force_N", 300.0), ("shift_mm", 0.0), ("from_s", 103.0), ("to_s", 104.0)):
        low, high = cause["parameters"][name]["ci95"]
        assert low <= value <= high
    assert cause["parameters"]["force_N"]["value"] == pytest.approx(300.0, rel=0.02)


def test_the_program_makes_room_for_what_is_known_to_happen(tmp_path):
    """A line of 4 s along x: for one second of it, y is led 20 um to the other side, and back within 5 ms."""
    program = tmp_path / "in.nc"
    program.write_text("G21 G90 G17 G94\nG0 X0 Y0 Z0\nG1 X40 F600\nM2\n")
    effect = "{effect: disturbance, target: y, shift_mm: 0.02, from_s: 1.5, to_s: 2.5}"
    (tmp_path / "more.yaml").write_text(f"effects: [{effect}]\nprocess: {{force: {{model: none}}}}\n")
    files = ["--config", "config/cartesian.yaml", "--config", str(tmp_path / "more.yaml")]
    code, said = runner.invoke(["compensate", str(program), *files, "-o", str(tmp_path / "out.nc")])
    assert code == 0, said
    line = Timeline(read((tmp_path / "out.nc").read_text()), looks_ahead=True)
    tip = line.sample(np.linspace(0.0, line.log_end, 2001))["tip"]
    away = tip[np.abs(tip[:, 1] + 0.02) < 1e-3, 0]
    assert away.min() == pytest.approx(15.05, abs=0.05) and away.max() == pytest.approx(24.95, abs=0.05)
    assert not tip[(tip[:, 0] < 14.9) | (tip[:, 0] > 25.1), 1].any()
