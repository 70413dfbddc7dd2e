"""Recorded motions through `camcomp diagnose`: LinuxCNC's blended corners are no error, and play on top of them is play."""

from tests.campaign import runner
from tests.trials.experiment import Plan, make, write

SMALL = {"runs": 3, "rows": 250, "paths": ("circles-blended", "zigzag-blended", "pocket-10um"), "stated": False}


def answer(plan, folder):
    """What the tool says and what the plant knows."""
    made = make(plan)
    return runner.ask(write(made, plan, folder)), made.record


def test_nothing_is_wrong(tmp_path):
    result, truth = answer(Plan(3, rapids=True, **SMALL), tmp_path)
    assert (result["verdict"], result["causes"]) == ("none", [])
    assert truth["noise_um"] <= result["floor"]["um"] <= 1.5 * truth["noise_um"]


def test_play_is_play(tmp_path):
    plan = Plan(4, "single", (("backlash", "y"),), (3.0,), rapids=True, **SMALL)
    result, truth = answer(plan, tmp_path)
    assert [(each["effect"], each["target"]) for each in result["causes"]] == [("backlash", "y")]
    assert result["verdict"] == "identified"
    low, high = result["causes"][0]["parameters"]["width_mm"]["ci95"]
    assert low <= truth["causes"][0]["parameters"]["width_mm"] <= high
