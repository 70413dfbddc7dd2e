"""Play behind a loaded drive: the load decides on which flank its carriage lies, by plants with a dead zone in the spring."""

import json

import numpy as np
import pytest

from camcomp.effects import backlash
from camcomp.model.effect import Motion
from tests.commandline import table
from tests.oracles.machines import MACHINES
from tests.validation.recorded.faults import Fault, Faults
from tests.validation.runner import invoke

KUKA = MACHINES["kuka-kr210"]
CIRCLE = "G21 G90 G17\nS8000 M3\nG0 X8 Y0 Z5\nG1 Z-1 F300\nG3 X8 Y0 I-8 J0 F600\nG0 Z5\nM30\n"


def written(tmp_path, target):
    (tmp_path / "in.nc").write_text(CIRCLE)
    entry = {"effect": "backlash", "target": target, "width_rad": 3e-4}
    (tmp_path / "effects.yaml").write_text(json.dumps({"effects": [entry]}))
    return ["--config", str(KUKA.config), "--config", str(tmp_path / "effects.yaml")]


def columns(path, template, names):
    found = table(path)
    return np.column_stack([found[template.format(each)] for each in names])


def test_simulated_tips_are_those_of_a_spring_with_a_dead_zone(tmp_path):
    words = written(tmp_path, "A2")
    code, said = invoke(
        ["simulate", str(tmp_path / "in.nc"), *words, "-o", str(tmp_path / "log.csv"), "--step-s", "0.25"]
    )
    assert code == 0, said
    told = columns(tmp_path / "log.csv", "cmd_{}_rad", KUKA.actuators)
    force = columns(tmp_path / "log.csv", "f{}_N", "xyz")
    tip, _ = KUKA.settle(Faults([Fault("backlash", "A2", {"width_rad": 3e-4})]), told, force)
    np.testing.assert_allclose(
        columns(tmp_path / "log.csv", "{}_mm", "xyz"), tip - KUKA.origin, atol=1.5e-3
    )  # 1 urad of a joint


@pytest.mark.parametrize("target", ["A1", pytest.param("A5", marks=pytest.mark.campaign)])
def test_a_play_whose_load_turns_round_changes_its_flank_there(tmp_path, target):
    """The side force turns A1 one way and the other: all but two short lines of the circle are right."""
    words = written(tmp_path, target)
    code, said = invoke(
        [
            "compensate",
            str(tmp_path / "in.nc"),
            *words,
            "-o",
            str(tmp_path / "out.nc"),
            "--joints",
            str(tmp_path / "j.csv"),
        ]
    )
    assert code == 0, said
    assert "at 2 places the load turns round" in said
    joints, drive = (columns(tmp_path / "j.csv", each, KUKA.actuators) for each in ("act_{}_rad", "act_{}_Nmm"))
    force, tip = columns(tmp_path / "j.csv", "f{}_N", "xyz"), columns(tmp_path / "j.csv", "{}_mm", "xyz")
    found, _ = KUKA.settle(Faults([Fault("backlash", target, {"width_rad": 3e-4})]), joints, force)
    loaded = np.abs(drive[:, KUKA.actuators.index(target)]) > 1.0
    assert 1e3 * np.linalg.norm(found - KUKA.origin - tip, axis=1)[loaded].max() < 1.0
    code, said = invoke(["verify", str(tmp_path / "out.nc"), "--against", str(tmp_path / "in.nc"), *words])
    assert code == 0, said


def moved(values, held, friction, **width):
    n = len(values)
    t, x = np.arange(n) * 0.1, np.array(values, float)[:, None]
    loads = np.array(held, float)[:, None]
    motion = Motion(
        time=t, common=t, cut_min=t, temperature=None, encoder=x, speed=0 * x, direction=0 * x, home=np.zeros(1),
        stiffness=np.ones(1), held=lambda: loads, friction=friction,
    )  # fmt: skip
    return backlash.on_drive(0 * x, motion, np.ones(1), width)[:, 0]


THERE_AND_BACK = [0.0, 1.0, 2.0, 1.0, 0.0]


def test_guides_hold_a_slide_on_the_flank_of_its_last_motion():
    np.testing.assert_allclose(moved(THERE_AND_BACK, [500.0] * 5, None, width_mm=0.2), [0, -0.1, -0.1, 0.1, 0.1])


def test_a_gear_gives_way_to_its_load():
    np.testing.assert_allclose(moved(THERE_AND_BACK, [9, 9, 9, -9, -9], None, width_rad=0.2), [-0.1] * 3 + [0.1] * 2)
    np.testing.assert_allclose(moved(THERE_AND_BACK, [0.0] * 5, None, width_rad=0.2), [0, -0.1, -0.1, 0.1, 0.1])


def test_stated_friction_holds_the_carriage_against_what_is_less():
    held = [60.0, 60.0, 40.0, 40.0, -60.0]
    np.testing.assert_allclose(
        moved(THERE_AND_BACK, held, np.array([50.0]), width_mm=0.2), [-0.1, -0.1, -0.1, 0.1, 0.1]
    )
    np.testing.assert_allclose(
        moved(THERE_AND_BACK, held, np.array([50.0]), width_rad=0.2), [-0.1, -0.1, -0.1, 0.1, 0.1]
    )
