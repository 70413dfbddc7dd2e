"""What is named instead of something that no library has."""

import pytest

from tests.trials.experiment import Plan
from tests.trials.test_diagnosed import answer

ROUTER = {"machine": "router", "runs": 3, "rows": 200, "stated": False}


def test_three_causes_that_one_unknown_effect_does_as_well_are_not_named(tmp_path):
    """A rack's period on a short travel looks like a bow, a squareness and an offset together."""
    plan = Plan(901004, "unknown", (("rack_period", "y"),), (3.0,), **ROUTER)
    result, _ = answer(plan, tmp_path)
    assert result["verdict"] == "unknown"
    assert [each["effect"] for each in result["causes"]] == ["unknown"]


@pytest.mark.campaign
def test_a_lag_that_any_function_of_velocity_draws_but_for_what_is_minor_is_the_lag(tmp_path):
    """Such a family draws small things beside the lag as well: nothing unknown is claimed for less than is minor at the tip."""
    causes = (("servo_lag", None), ("gravity", None))
    result, _ = answer(Plan(1532000, "pair", causes, (3.0, 6.0), machine="router", runs=4, rows=300), tmp_path)
    assert result["verdict"] == "identified"
    assert {(each["effect"], each["target"]) for each in result["causes"]} == set(causes)
