"""Answers on runs of programs, made by generators that were written from the contract alone."""

import json

import numpy as np
import pytest

from tests.validation.parallel.__main__ import write as parallel
from tests.validation.recorded import metamorphic
from tests.validation.recordings import recording
from tests.validation.scoring import ask, judge, library
from tests.validation.serial.make import make as serial


def judged(folder, generator, seed):
    if generator == "serial":
        serial(seed, folder, None)
    else:
        parallel(seed, folder, None)
    truth = json.loads((folder / "truth" / f"e-{seed}.json").read_text())
    result = ask(folder / f"e-{seed}" / "experiment.yaml")
    return result, judge(result, truth, library())


def test_a_log_with_empty_set_points_of_a_machine_with_nothing_wrong(tmp_path):
    """At a corner the row without the set-point of x had its set-point of z, 0.38 mm from the line between its neighbours."""
    result, _ = judged(tmp_path, "serial", 5008)
    assert (result["verdict"], result["causes"]) == ("none", [])


@pytest.mark.campaign
def test_a_bending_tool_that_one_run_of_three_shows(tmp_path):
    """The other runs are in the air, where no force bends the tool."""
    result, row = judged(tmp_path, "serial", 11032)
    assert result["verdict"] == "identified" and row["held"] == [True]
    assert [each["effect"] for each in result["causes"]] == ["tool_deflection"]


@pytest.mark.campaign  # the longest of this file
def test_a_lag_of_all_axes_is_no_clock_where_forces_are_logged_and_encoders_are_not(tmp_path):
    """Forces and what bends under them come as late as the axes; a late clock would shift the tip only."""
    result, row = judged(tmp_path, "serial", 44084)
    assert result["verdict"] == "identified" and row["all"] and not row["false_cause"]


@pytest.mark.campaign  # the longest of this file
def test_a_cause_that_leaves_the_gap_as_it_is_is_not_sure(tmp_path):
    """A loop that rings after every corner, tip alone: an overshoot leaves the gap as it is."""
    with recording.taken_from("spirals"):
        result, row = judged(tmp_path, "serial", 59015)
    assert result["verdict"] in ("ambiguous", "unknown") and not row["false_cause"]


@pytest.mark.campaign  # the longest of this file
def test_lines_that_a_control_merges_are_no_gap(tmp_path):
    """A log of the tip on a machine without causes: LinuxCNC makes one line of several within 50 um in G64 P0.05."""
    with recording.taken_from("rosettes"):
        result, _ = judged(tmp_path, "parallel", 71020)
    assert (result["verdict"], result["causes"]) == ("none", [])


@pytest.mark.campaign  # the longest of this file
def test_what_is_far_behind_in_rapids_is_no_outlier(tmp_path):
    """A lag that grows with the square of the speed: at half the rate few rows are fast, which left a lag, sure."""
    with recording.taken_from("feed_modes"):
        judged(tmp_path, "serial", 74009)
    files = metamorphic.read(tmp_path / "e-74009")
    result = ask(metamorphic.write(metamorphic.half_the_rate(files, np.random.default_rng(0))[0], tmp_path / "half"))
    assert result["verdict"] == "unknown"


@pytest.mark.campaign
def test_a_gap_that_is_not_above_the_floor_has_no_cause(tmp_path):
    """A lag of all axes in a log of the tip, which does not reduce the gap."""
    with recording.taken_from("rosettes"):
        result, _ = judged(tmp_path, "parallel", 71031)
    assert (result["verdict"], result["causes"]) == ("none", [])


@pytest.mark.campaign
def test_how_fast_a_tool_is_between_stops_rows_do_not_say(tmp_path):
    """G61.1 on lines of 1 mm, a row every 20 ms: what the force was off by seemed to be a push."""
    with recording.taken_from("rosettes"):
        result, row = judged(tmp_path, "serial", 70005)
    assert result["verdict"] == "ambiguous" and row["first_or_class"] and not row["false_cause"]


@pytest.mark.campaign
def test_two_joints_that_do_the_same_have_the_same_minor_causes_beside_them(tmp_path):
    """A shift of A4 does the same as one of A1; friction elsewhere is minor jointly with either."""
    result, row = judged(tmp_path, "serial", 49122)
    assert result["verdict"] == "ambiguous" and row["first_or_class"]


@pytest.mark.campaign
def test_a_log_that_begins_near_the_end_of_its_program_has_missed_nothing(tmp_path):
    result, row = judged(tmp_path, "serial", 49071)
    assert result["verdict"] == "identified" and row["all"] and all(row["held"])


@pytest.mark.campaign
@pytest.mark.parametrize(
    "seed",
    [47052, 47000, 44087],
    ids=["friction", "a shift where noise seems to have a memory", "a shift and a workpiece"],
)
def test_what_is_minor_and_when_it_happened_are_known(tmp_path, seed):
    """A spring some per cent off, far below the noise, was something unknown; of shifts the begin was found only."""
    result, row = judged(tmp_path, "serial", seed)
    assert result["verdict"] == "identified" and row["all"] and not row["false_cause"]


@pytest.mark.campaign
@pytest.mark.parametrize(
    ("generator", "seed", "named"),
    [
        ("serial", 7011, {"link_stiffness", "screw_cyclic"}),
        ("serial", 7032, {"link_stiffness", "cutting_force"}),
        ("serial", 7033, {"link_stiffness", "tool_wear"}),
        ("parallel", 9510, set()),
    ],
    ids=["springs and a screw", "springs and a force", "springs and a worn tool", "two causes that undo each other"],
)
def test_rows_follow_their_own_force(tmp_path, generator, seed, named):
    """In corners that are rounded off, and while the tool rests in its cut; in the last one two causes undo each other."""
    result, row = judged(tmp_path, generator, seed)
    assert {each["effect"] for each in result["causes"]} == named
    assert (result["verdict"] == "none") == (not named) and not row["false_cause"]


@pytest.mark.campaign
def test_play_of_an_axis_that_plunges_when_the_log_begins(tmp_path):
    result, row = judged(tmp_path, "serial", 7010)
    assert [(each["effect"], each["target"]) for each in result["causes"]] == [("backlash", "z")]
    assert row["held"] == [True]


@pytest.mark.campaign
@pytest.mark.parametrize(
    ("generator", "seed"),
    [("serial", 5013), ("serial", 5025), ("parallel", 6003), ("parallel", 43140), ("serial", 44067), ("serial", 44119)],
    ids=["rings", "slips under force", "chirps", "waves", "lags with the square of the speed", "goes with the grain"],
)
def test_what_imitates_something_unknown_is_not_named_for_certain(tmp_path, generator, seed):
    result, row = judged(tmp_path, generator, seed)
    assert result["verdict"] == "unknown" and not row["false_cause"]


@pytest.mark.campaign
@pytest.mark.parametrize(
    ("generator", "seed"),
    [
        ("serial", 17000),
        ("parallel", 41079),
        ("parallel", 41023),
    ],
    ids=["far from where it was scanned", "warm-ups have several time constants", "a factor is of the whole force"],
)
def test_intervals_hold_what_they_are_of(tmp_path, generator, seed):
    """A shape that is steps away from the best of the scan stopped on its way, with the interval of where it stood."""
    _, row = judged(tmp_path, generator, seed)
    assert row["all"] and row["held"] and all(row["held"])


@pytest.mark.campaign
def test_play_where_a_tool_bends_by_a_third_of_the_arcs_that_it_goes_round(tmp_path):
    """Only the tip is logged: where on an arc of 5 mm it is follows from how its 1.5 mm of bending point, and those from where it is."""
    with recording.taken_from("spirals"):
        result, row = judged(tmp_path, "parallel", 57045)
    assert result["verdict"] == "identified" and row["all"] and all(row["held"])
