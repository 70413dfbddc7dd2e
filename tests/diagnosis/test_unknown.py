"""Effects that the library does not have, some of which a few of its members could follow for a while."""

import pytest

from camcomp.api.diagnosis import diagnose
from tests.diagnosis.conftest import plan_of
from tests.validation.plants.causes import Cause
from tests.validation.plants.experiments import Plan

GROWTH = plan_of(("spindle_growth", None), design="six", samples=150)
CREEP = plan_of(("creep", "x"), design="six", samples=150)
CROSSTALK = plan_of(("force_crosstalk", "y"), design="six", samples=150, seed=62)


@pytest.mark.campaign  # those below have some in the plain run
@pytest.mark.parametrize(
    ("plan", "driver"),
    [
        (GROWTH, ("time:z", "temperature:z")),
        (CREEP, ("time:x", "temperature:x")),
        (CROSSTALK, ("force:z",)),
    ],
)
def test_what_differs_from_run_to_run_is_not_taken_for_something_that_lasts(workshop, plan, driver):
    result = workshop.answer(plan)[0]
    assert result["verdict"] == "unknown"
    assert [cause["effect"] for cause in result["causes"]] == ["unknown"]
    assert any(each["covariate"] in driver for each in result["where"]["drivers"][:3])


def test_a_known_cause_is_named_beside_an_unknown_one(workshop):
    result = workshop.answer(plan_of(("drive_stiffness", "y"), ("clamp_slip", None)))[0]
    assert result["verdict"] == "unknown"
    first = result["causes"][0]
    assert (first["effect"], first["target"]) == ("drive_stiffness", "y")
    assert len(result["causes"]) == 2


@pytest.mark.campaign  # a known cause beside an unknown one is in the plain run
def test_after_an_unknown_effect_one_thing_is_changed_and_the_rest_left(workshop):
    result, diagnosis, _ = workshop.answer(CROSSTALK)
    assert result["next_experiment"]["separates"] == ["unknown"]
    assert 0.1 < result["next_experiment"]["gain"] <= 1.0
    assert set(diagnosis.proposal.candidate.varies) & {
        each["covariate"].split(":")[0] for each in result["where"]["drivers"]
    }
    assert "M2" in diagnosis.proposal.candidate.program


@pytest.mark.campaign
@pytest.mark.xfail(strict=True, reason="identified so far")
def test_members_that_undo_each_other_explain_nothing(workshop):
    """Soft links tilt the platform; jointly, a longer tool and a lower workpiece do so with any lever."""
    plan = Plan(81015, (Cause("link_stiffness", None, 88934),), (10.0,), world=8)
    result = diagnose(workshop.made(plan)[0], without=("link_stiffness",)).result.as_json()
    assert result["verdict"] == "unknown"
    assert "tool_length" not in [cause["effect"] for cause in result["causes"]]
