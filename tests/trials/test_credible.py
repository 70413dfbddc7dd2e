"""What is named instead of something that no library has."""

from tests.trials.experiment import Plan
from tests.trials.test_diagnosed import answer

ROUTER = {"machine": "router", "runs": 3, "rows": 200, "stated": False}


def test_three_causes_that_one_unknown_effect_does_as_well_are_not_named(tmp_path):
    """A rack's period on a short travel looks like a bow, a squareness and an offset together."""
    plan = Plan(901004, "unknown", (("rack_period", "y"),), (3.0,), **ROUTER)
    result, _ = answer(plan, tmp_path)
    assert result["verdict"] == "unknown"
    assert [each["effect"] for each in result["causes"]] == ["unknown"]
