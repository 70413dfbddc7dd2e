"""Causes named together with an effect that no library has: all that is certain, and no imitation of it for certain."""

import pytest

from tests.diagnosis.test_diagnosed import answer
from tests.validation.recorded.experiment import Plan
from tests.validation.recorded.sensors import Sensors

LONG = {"runs": 4, "rows": 300, "channels": "full", "sensors": Sensors(tip_mm=3e-3)}


def beside(folder, seed, machine, known, unknown):
    plan = Plan(seed, "unknown", (known, unknown), (9.0, 6.0), machine=machine, **LONG)
    result, _ = answer(plan, folder)
    assert result["verdict"] == "unknown"
    return {(each["effect"], each["target"]) for each in result["causes"] if each["effect"] != "unknown"}


@pytest.mark.campaign
def test_the_friction_that_a_drive_feels_is_no_part_of_the_bump_that_only_the_tip_shows(tmp_path):
    """Both are the axis y's own, and the bump is half as large as what friction does to the tip."""
    known = ("friction", "y")
    assert beside(tmp_path, 2090001, "router", known, ("guide_bump", "y")) == {known}


@pytest.mark.campaign
def test_the_play_that_the_tip_shows_is_no_part_of_what_rings_in_the_encoder(tmp_path):
    known = ("backlash", "a")
    assert beside(tmp_path, 2090005, "delta", known, ("servo_resonance", "a")) == {known}


@pytest.mark.campaign
def test_a_soft_drive_stands_though_another_that_hardens_does_a_part_of_it(tmp_path):
    """A soft drive x instead of it predicts held-out runs badly."""
    known = ("drive_stiffness", "z")
    assert beside(tmp_path, 2091011, "puu", known, ("hardening", "x")) == {known}


def test_a_loop_that_rings_twice_as_much_as_what_is_left_of_its_drive_is_not_sure(tmp_path):
    """Either something else rings there by chance, or the loop is its imitation."""
    plan = Plan(1833009, "unknown", (("servo_resonance", "x"),), (10.0,), machine="router", **LONG)
    result, _ = answer(plan, tmp_path)
    assert result["verdict"] == "unknown"
    assert max([each["probability"] for each in result["causes"] if each["effect"] != "unknown"], default=0.0) <= 0.8


def test_what_a_rack_does_is_no_clamping_that_is_off_for_sure(tmp_path):
    """A turned workpiece explains a part of it that is no larger than what is left."""
    plan = Plan(9100012, "unknown", (("screw_cyclic", "c"), ("rack_period", "y")), (9.0, 5.0), machine="delta", **LONG)
    result, _ = answer(plan, tmp_path)
    assert result["verdict"] == "unknown"
    assert sum(each["probability"] for each in result["causes"] if each["effect"] == "workpiece_frame") < 0.5


def test_play_that_only_the_way_across_the_path_shows_is_no_cause_that_returns_smoothly(tmp_path):
    """Without set-points the way along the path is unknown; what is left across it counts all the same."""
    plan = Plan(9000023, "unknown", (("joint_hysteresis", "z"),), (10.0,), machine="router", channels="tip",
                runs=4, rows=300, sensors=Sensors(tip_mm=3e-3))  # fmt: skip
    result, _ = answer(plan, tmp_path)
    assert result["verdict"] == "unknown"
    assert max([each["probability"] for each in result["causes"] if each["effect"] != "unknown"], default=0.0) < 0.9


@pytest.mark.campaign
def test_what_begins_at_two_drives_at_once_is_no_disturbance_of_either(tmp_path):
    """A clamping that slips moves the workpiece along both."""
    plan = Plan(2303005, "unknown", (("clamp_slip", "x"),), (10.0,), **LONG)
    result, _ = answer(plan, tmp_path)
    assert result["verdict"] == "unknown"
    assert [each["effect"] for each in result["causes"]] == ["unknown"]
