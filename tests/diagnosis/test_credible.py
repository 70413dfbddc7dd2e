"""Causes named in place of an effect that no library has."""

import pytest

from tests.diagnosis.test_diagnosed import answer
from tests.validation.recorded.__main__ import mixed
from tests.validation.recorded.experiment import Plan
from tests.validation.recorded.sensors import Sensors

ROUTER = {"machine": "router", "runs": 3, "rows": 200, "stated": False}
LONG = {"runs": 4, "rows": 300, "channels": "full", "sensors": Sensors(tip_mm=3e-3)}


@pytest.mark.campaign  # test_unknown, test_found_laws and test_metamorphic have some in the plain run
def test_three_causes_that_one_unknown_effect_does_as_well_are_not_named(tmp_path):
    """A rack's period on a short travel looks like a bow, a squareness and an offset together."""
    plan = Plan(901004, "unknown", (("rack_period", "y"),), (3.0,), **ROUTER)
    result, _ = answer(plan, tmp_path)
    assert result["verdict"] == "unknown"
    assert [each["effect"] for each in result["causes"]] == ["unknown"]


@pytest.mark.campaign
def test_a_lag_that_any_function_of_velocity_draws_but_for_what_is_minor_is_the_lag(tmp_path):
    """Such a family fits small deviations as well as the lag: those below MINOR at the tip are no unmodelled cause."""
    causes = (("servo_lag", None), ("gravity", None))
    result, _ = answer(Plan(1532000, "pair", causes, (3.0, 6.0), machine="router", runs=4, rows=300), tmp_path)
    assert result["verdict"] == "identified"
    assert {(each["effect"], each["target"]) for each in result["causes"]} == set(causes)


@pytest.mark.campaign
def test_springs_of_several_joints_are_one_thing_that_gives_way(tmp_path):
    """Any law of the force does the same as these springs jointly, so no unmodelled cause is claimed."""
    result, _ = answer(Plan(1544004, "imperfect", imperfect=True, machine="kuka-kr210", **LONG), tmp_path)
    assert result["verdict"] != "unknown"
    assert {("drive_stiffness", "A3"), ("cutting_force", None)} <= {
        (each["effect"], each["target"]) for each in result["causes"] if each["probability"] > 0.95
    }


@pytest.mark.campaign
def test_where_a_play_stood_for_four_rows_before_its_first_motion_is_no_disturbance(tmp_path):
    causes = (("backlash", "b"), ("screw_pitch", "a"))
    result, _ = answer(Plan(1512009, "pair", causes, (6.0, 3.0), machine="delta", **LONG), tmp_path)
    assert "disturbance" not in {each["effect"] for each in result["causes"]}


@pytest.mark.campaign
@pytest.mark.xfail(strict=True, reason="a play is named beside it, sure")
def test_what_a_law_of_friction_says_wrongly_is_no_play_beside_it(tmp_path):
    """The guide of the plant turns its friction round in another way: 3 um of 52."""
    result, _ = answer(Plan(1631017, "single", (("friction", "y"),), (10.0,), machine="router", **LONG), tmp_path)
    assert (result["verdict"], [each["effect"] for each in result["causes"]]) == ("identified", ["friction"])


@pytest.mark.campaign
def test_a_lag_stands_beside_a_friction_whose_law_is_a_little_wrong(tmp_path):
    """A law of the velocity fits the lag and the residual of the law of friction."""
    causes = (("servo_lag", None), ("friction", "x"))
    result, _ = answer(Plan(1632000, "pair", causes, (3.0, 9.0), machine="router", **LONG), tmp_path)
    assert result["verdict"] == "identified"
    assert {(each["effect"], each["target"]) for each in result["causes"]} == set(causes)


@pytest.mark.campaign
def test_a_drive_that_hardens_is_no_soft_drive(tmp_path):
    """A straight spring does most of it; what depends on this drive's own force in any way does all of it."""
    result, _ = answer(Plan(1623006, "unknown", (("hardening", "y"),), (10.0,), machine="puu", **LONG), tmp_path)
    assert (result["verdict"], [each["effect"] for each in result["causes"]]) == ("unknown", ["unknown"])


@pytest.mark.campaign
@pytest.mark.xfail(strict=True, reason="the residual is at its noise: ambiguous")
def test_a_guide_that_is_not_straight_is_no_wrong_zero_with_a_squareness(tmp_path):
    """Tolerances of zeros stretch to cover it: what takes the place of causes is told even so."""
    result, _ = answer(
        Plan(1643002, "unknown", (("straightness", "y"),), (3.0,), machine="kuka-kr210", **LONG), tmp_path
    )
    assert (result["verdict"], [each["effect"] for each in result["causes"]]) == ("unknown", ["unknown"])


@pytest.mark.campaign
@pytest.mark.xfail(strict=True, reason="a wave and an offset share the answer: ambiguous")
def test_a_bump_of_a_guide_is_no_wave_with_a_pitch(tmp_path):
    result, _ = answer(Plan(1523001, "unknown", (("guide_bump", "z"),), (10.0,), machine="puu", **LONG), tmp_path)
    assert (result["verdict"], [each["effect"] for each in result["causes"]]) == ("unknown", ["unknown"])


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(1744002, id="one arm", marks=pytest.mark.campaign),
        pytest.param(1744005, id="another arm"),
        pytest.param(
            1744007,
            id="a third arm",
            marks=(pytest.mark.campaign, pytest.mark.xfail(strict=True, reason="A2 has 0.23")),
        ),
    ],
)
def test_springs_some_per_cent_off_are_found_though_a_length_or_a_soft_tool_does_for_two_of_them(tmp_path, seed):
    """Two of them are exchanged for one at once; a set with a member that may be minor lowers the probability of others."""
    result, _ = answer(Plan(seed, "imperfect", imperfect=True, machine="kuka-kr210", **LONG), tmp_path)
    found = {(each["effect"], each["target"]): each["probability"] for each in result["causes"]}
    assert min(found["cutting_force", None], found["drive_stiffness", "A2"], found["drive_stiffness", "A3"]) > 0.5
    assert {effect for (effect, _), p in found.items() if p > 0.5} == {"cutting_force", "drive_stiffness"}


@pytest.mark.campaign
@pytest.mark.parametrize("seed", [1544009, 1644002], ids=["one arm", "another arm"])
def test_springs_of_two_joints_that_give_way_alike_are_alternatives(tmp_path, seed):
    """Found greedily, a frame and an offset stand for springs, and with them one joint for another."""
    result, _ = answer(Plan(seed, "imperfect", imperfect=True, machine="kuka-kr210", **LONG), tmp_path)
    true = {("cutting_force", None), *(("drive_stiffness", f"A{n}") for n in (1, 2, 3))}
    sure = {(each["effect"], each["target"]) for each in result["causes"] if each["probability"] > 0.8}
    assert result["verdict"] == "ambiguous"
    assert sure < true
    assert true in [{(each["effect"], each["target"]) for each in every} for every in result["alternatives"]]


@pytest.mark.campaign
@pytest.mark.xfail(strict=True, reason="the interval of the shrinkage begins at 0")
def test_a_smaller_force_and_softer_links_are_both_there_though_the_tip_hardly_shows_them(tmp_path):
    result, _ = answer(Plan(1604006, "imperfect", imperfect=True, machine="orthoglide", **LONG), tmp_path)
    assert {(each["effect"], each["target"]) for each in result["causes"]} == {
        ("cutting_force", None), ("link_stiffness", None)
    }  # fmt: skip
    assert result["shrinkage"]["ci95"][0] > 0.0


@pytest.mark.campaign
def test_a_squareness_that_shows_where_the_tool_plunges_is_no_slip_of_the_clamping(tmp_path):
    causes = (("squareness", "yz"), ("servo_lag", "A5"))
    result, _ = answer(Plan(1642009, "pair", causes, (3.0, 9.0), machine="kuka-kr210", **LONG), tmp_path)
    assert {(each["effect"], each["target"]) for each in result["causes"]} == set(causes)


@pytest.mark.campaign
def test_a_ringing_drive_is_not_for_sure_a_loop_that_rings_half_as_much(tmp_path):
    """Its mean over eight rows is zero; row by row the residual is 37 of its 58 um."""
    plan = Plan(1543009, "unknown", (("servo_resonance", "A2"),), (10.0,), machine="kuka-kr210", **LONG)
    result, _ = answer(plan, tmp_path)
    assert result["verdict"] == "unknown"
    assert max([each["probability"] for each in result["causes"] if each["effect"] != "unknown"], default=0.0) < 0.8


@pytest.mark.campaign
def test_a_lag_is_known_though_the_rows_begin_and_go_on_in_a_plunge(tmp_path):
    """Rapids are not logged; the drive was in motion when they ended."""
    result, _ = answer(Plan(1731011, "single", (("servo_lag", "z"),), (10.0,), machine="router", **LONG), tmp_path)
    assert (result["verdict"], [each["target"] for each in result["causes"]]) == ("identified", ["z"])


@pytest.mark.campaign
def test_a_late_drive_is_no_riddle_where_rapids_have_few_rows(tmp_path):
    """A row every 49 ms, a drive that is 9 ms late: where it stands while a rapid speeds up nobody knows."""
    causes = (("screw_cyclic", "z"), ("servo_lag", "z"))
    result, _ = answer(Plan(1732005, "pair", causes, (3.0, 9.0), machine="router", **LONG), tmp_path)
    assert result["verdict"] == "identified"
    assert {(each["effect"], each["target"]) for each in result["causes"]} == set(causes)


@pytest.mark.campaign
def test_a_drive_that_rings_shows_at_its_encoder_where_it_changes_its_speed(tmp_path):
    plan = Plan(1823009, "unknown", (("servo_resonance", "y"),), (10.0,), machine="puu", **LONG)
    result, _ = answer(plan, tmp_path)
    assert (result["verdict"], [each["effect"] for each in result["causes"]]) == ("unknown", ["unknown"])


@pytest.mark.campaign
def test_what_only_tolerances_smaller_than_stated_ask_for_is_not_believed(tmp_path):
    """Where small errors do not show, small tolerances fit better, and one small error that does show becomes a cause."""
    causes = (("servo_lag", None), ("drive_stiffness", "A1"))
    result, _ = answer(Plan(1742000, "pair", causes, (3.0, 9.0), machine="kuka-kr210", **LONG), tmp_path)
    assert {(each["effect"], each["target"]) for each in result["causes"] if each["probability"] > 0.5} == set(causes)


@pytest.mark.campaign
@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(1844008, id="one arm"),
        pytest.param(1844009, id="another arm", marks=pytest.mark.xfail(strict=True, reason="A2 has 0.27")),
        pytest.param(2044008, id="a third arm"),
    ],
)
def test_a_spring_too_small_to_be_named_speaks_for_the_springs_beside_it(tmp_path, seed):
    """A5 moves the tip by less than is minor; a soft tool with a stiff A5, or a longer link, took its place and that of others."""
    result, _ = answer(Plan(seed, "imperfect", imperfect=True, machine="kuka-kr210", **LONG), tmp_path)
    found = {(each["effect"], each["target"]): each["probability"] for each in result["causes"]}
    assert min(found["cutting_force", None], found["drive_stiffness", "A2"], found["drive_stiffness", "A3"]) > 0.5
    assert {effect for effect, _ in found} == {"cutting_force", "drive_stiffness"}


@pytest.mark.campaign
def test_a_force_and_links_that_undo_each_other_are_named_where_a_little_is_left_beside_them(tmp_path):
    """Per cents of a millimetre: 45 and 36 um, 14 together, and what is left was as large as a cause of 14 um is known to."""
    result, _ = answer(mixed(5100086, False)[1], tmp_path)
    assert result["verdict"] == "identified"
    assert {each["effect"] for each in result["causes"]} == {"cutting_force", "link_stiffness"}
