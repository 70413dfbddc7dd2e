"""What is named beside, or instead of, something that no library has; and that nothing is named which a log cannot know."""

import csv

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


def test_temperature_may_be_logged_in_some_runs_only(tmp_path):
    plan = Plan(3, runs=2, rows=100, stated=False, paths=("circles-blended", "zigzag-blended"))

    def forget(folder):
        log = folder / "log-1.csv"
        rows = list(csv.DictReader(log.read_text().splitlines()))
        keys = [key for key in rows[0] if key != "temp_C"]
        with log.open("w", newline="") as file:
            writer = csv.DictWriter(file, keys, extrasaction="ignore")
            writer.writeheader()
            writer.writerows(rows)

    result, _ = answer(plan, tmp_path, before=forget)
    assert result["verdict"] == "none"
