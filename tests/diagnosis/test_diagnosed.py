"""Recorded motions through `camcomp diagnose`: LinuxCNC's blended corners are no error, and play on top of them is play."""

import json

import pytest
import yaml

from tests.contradictions import contradictions
from tests.validation import runner
from tests.validation.recorded.experiment import Plan, make, write

SMALL = {"runs": 3, "rows": 250, "paths": ("circles-blended", "zigzag-blended", "pocket-10um"), "stated": False}


def answer(plan, folder, *options):
    """The answer of the tool and the truth of the plant."""
    made, said = make(plan), folder / "result.json"
    code, text = runner.invoke(["diagnose", str(write(made, plan, folder)), "--json", str(said), *options])
    assert code == 0, text
    result = json.loads(said.read_text())
    assert contradictions(result) == []
    return result, made.record


@pytest.mark.campaign  # test_answers_on_programs has one in the plain run
def test_nothing_is_wrong(tmp_path):
    result, truth = answer(Plan(3, rapids=True, **SMALL), tmp_path)
    assert (result["verdict"], result["causes"]) == ("none", [])
    assert truth["noise_um"] <= result["floor"]["um"] <= 1.5 * truth["noise_um"]


@pytest.mark.campaign  # test_every_machine has one in the plain run
def test_play_is_play(tmp_path):
    plan = Plan(4, "single", (("backlash", "y"),), (3.0,), rapids=True, **SMALL)
    result, truth = answer(plan, tmp_path)
    assert [(each["effect"], each["target"]) for each in result["causes"]] == [("backlash", "y")]
    assert result["verdict"] == "identified"
    low, high = result["causes"][0]["parameters"]["width_mm"]["ci95"]
    assert low <= truth["causes"][0]["parameters"]["width_mm"] <= high


@pytest.mark.campaign  # test_found_laws has one in the plain run
def test_what_acts_for_a_while_is_found_beside_a_known_cause_and_located(tmp_path):
    """A drive is pushed aside for some seconds of one run, on a machine with play elsewhere; the library does without a name for it."""
    causes = (("backlash", "x"), ("disturbed_drive", "y"))
    result, truth = answer(
        Plan(6, "unknown", causes, (4.0, 6.0), rapids=True, **SMALL), tmp_path, "--without", "disturbance"
    )
    assert result["verdict"] == "unknown"
    assert [(each["effect"], each["target"]) for each in result["causes"]] == [("backlash", "x"), ("unknown", "y")]
    assert result["where"]["drivers"][0]["covariate"] == "time:y"
    pushed = truth["causes"][1]["parameters"]
    started = {
        each["name"]: each["started_s"] for each in yaml.safe_load((tmp_path / "experiment.yaml").read_text())["runs"]
    }
    first = result["where"]["intervals"][0]
    assert first["share"] > 0.9
    assert started[first["run"]] + first["t0_s"] == pytest.approx(pushed["when_s"], abs=0.5)
    assert first["t1_s"] - first["t0_s"] == pytest.approx(pushed["last_s"], abs=1.0)
