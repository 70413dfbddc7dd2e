"""A machine whose springs and force are all a little off is reported as such, not as similar causes."""

import json

import pytest

from camcomp.terminal.cli import run
from tests.validation.recorded.__main__ import messy, plan
from tests.validation.recorded.experiment import Plan, make, write
from tests.validation.recorded.sensors import Sensors


@pytest.mark.campaign
def test_springs_and_force_of_an_arm_are_not_taken_for_a_weight(tmp_path):
    """One cause at a time ends at a weight, a soft elbow and a length that undo one another in part."""
    base = Plan(0, machine="kuka-kr210", channels="no-forces", sensors=Sensors(tip_mm=3e-3), rows=300, runs=4)
    wanted = plan("imperfect", 448, 3300149, messy(base, ("early-lines",)), ())
    made = make(wanted)
    write(made, wanted, tmp_path)
    run(["diagnose", str(tmp_path / "experiment.yaml"), "--json", str(tmp_path / "found.json")])
    causes = json.loads((tmp_path / "found.json").read_text())["causes"]
    wrong = {(each["effect"], each["target"]) for each in made.record["causes"]}
    assert (causes[0]["effect"], causes[0]["target"]) == ("drive_stiffness", "A2")
    assert {(each["effect"], each["target"]) for each in causes} <= wrong, causes
