"""What is named instead of something that no library has, and that nothing is made of what a log cannot know."""

from tests.trials.experiment import Plan
from tests.trials.test_diagnosed import answer

ROUTER = {"machine": "router", "runs": 3, "rows": 200, "stated": False}


def named(result):
    """Effects and targets in their order."""
    return [(each["effect"], each["target"]) for each in result["causes"]]


def test_three_causes_that_one_unknown_effect_does_as_well_are_not_named(tmp_path):
    """A rack's period on a short travel looks like a bow, a squareness and an offset together."""
    plan = Plan(901004, "unknown", (("rack_period", "y"),), (3.0,), **ROUTER)
    result, _ = answer(plan, tmp_path)
    assert result["verdict"] == "unknown"
    assert [each["effect"] for each in result["causes"]] == ["unknown"]


def test_where_a_guide_holds_its_carriage_when_a_log_begins_is_no_finding(tmp_path):
    """Friction of ten times the noise winds a drive up until it has moved: either way."""
    plan = Plan(900001, "single", (("friction", "x"),), (10.0,), rapids=True, **ROUTER)
    result, _ = answer(plan, tmp_path)
    assert (result["verdict"], named(result)[0]) == ("identified", ("friction", "x"))
