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


def led(encoder, load, friction, width):
    """Where a nut stands (n,) behind its encoder (n,): load (n,) beyond the friction pushes it to its flank, else it is carried."""
    out, at = np.empty_like(encoder), encoder[0]
    for k, here in enumerate(encoder):
        at = min(max(at, here - 0.5 * width), here + 0.5 * width)
        if abs(load[k]) > friction:
            at = here + 0.5 * width * np.sign(load[k])
        out[k] = at
    return out


@pytest.mark.campaign
def test_a_slide_that_its_load_pushes_ahead_of_its_friction(tmp_path):
    """Guides hold 150 N, the load reaches 313 N: twice around the groove it pushes the carriage ahead of its drive."""
    plant, friction, width, y = MACHINES["orthoglide"], 150.0, 0.04, 1
    entries = [
        {"effect": "friction", "target": "y", "force_N": friction, "presliding_mm": 0.0028},
        {"effect": "backlash", "target": "y", "width_mm": width},
    ]
    (tmp_path / "effects.yaml").write_text(json.dumps({"effects": entries}))
    (tmp_path / "in.nc").write_text("G21 G90\nG0 X25 Y0 Z4\nG1 Z0 F300\nG3 X25 Y0 I-25 J0 F1200\nG0 Z20\nM30\n")
    words = ["--config", str(plant.config), "--config", str(tmp_path / "effects.yaml")]
    asked = [str(tmp_path / "in.nc"), *words, "-o", str(tmp_path / "out.nc"), "--joints", str(tmp_path / "j.csv")]
    code, said = invoke(["compensate", *asked])
    assert code == 0, said
    found = table(tmp_path / "j.csv")
    joints, force = (
        columns(tmp_path / "j.csv", "act_{}_mm", plant.actuators),
        columns(tmp_path / "j.csv", "f{}_N", "xyz"),
    )
    load = -plant.settle(Faults([]), joints, force)[1][:, y]
    nut = led(joints[:, y], load, friction, width)
    sense = np.sign(np.diff(nut, prepend=nut[0] - 1.0))
    turned = np.maximum.accumulate(np.where(np.diff(sense, prepend=0.0) != 0.0, np.arange(len(nut)), 0))
    sliding = np.abs(nut - nut[turned]) > 0.1
    joints[:, y] = nut - sense * friction / plant.drive_N_per_mm[y]
    tip = plant.settle(Faults([]), joints, force)[0] - plant.origin
    off = 1e3 * np.linalg.norm(tip - columns(tmp_path / "j.csv", "{}_mm", "xyz"), axis=1)
    judged = (found["line"] == 4) & sliding & (np.abs(np.abs(load) - friction) > 2.0)
    assert judged.sum() > 100 and (np.abs(load[judged]) > friction).any() and (np.abs(load[judged]) < friction).any()
    assert off[judged].max() < 1.2
