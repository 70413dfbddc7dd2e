"""The result of a diagnosis: one type for every kind of study, and its JSON keeps to the printed schema."""

import json
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from camcomp.diagnosis.axis.findings import AxisRun
from camcomp.diagnosis.report.answer import answer_lines
from camcomp.diagnosis.report.page import diagnosis_html
from camcomp.diagnosis.result.types import DiagnosisResult, Floor, Law, LawTerm, UnknownCause
from camcomp.terminal.cli import run
from tests.commandline import ROOT
from tests.report.diagnoses import result
from tests.schemas import check, validator
from tests.studies import axis_study

CONTRACT = (
    "verdict", "gap", "where", "causes", "alternatives", "shrinkage", "next_experiment", "minor", "floor", "outliers",
)  # fmt: skip


def axis_run(name="r", *, ripple=0.0, friction=30.0, noise=0.5, seed=0):
    t = np.arange(0.0, 16.0, 8e-3)
    x = 100 * np.sin(0.9 * t) + 40 * np.sin(2.3 * t + 0.4)
    speed = 90 * np.cos(0.9 * t) + 92 * np.cos(2.3 * t + 0.4)
    rng = np.random.default_rng(seed)
    force = friction * np.tanh(speed / 0.5) + 0.1 * speed + ripple * np.sin(2 * np.pi * x / 15.0)
    force += noise * rng.standard_normal(len(t))
    return AxisRun(
        name=name, time=t, setpoint=x + 0.005 * speed + 5e-4 * rng.standard_normal(len(t)), encoder=x, force=force
    )


@pytest.fixture(scope="module")
def axis():
    return axis_study({"x": [axis_run(ripple=3.0)]})


@pytest.fixture(scope="module")
def ambiguous(tmp_path_factory):
    out = tmp_path_factory.mktemp("ambiguous") / "r.json"
    words = ["diagnose", ROOT / "samples/diagnosis/ambiguous/experiment.yaml", "--json", out, "-q"]
    assert run([str(each) for each in words]) == 0
    return json.loads(out.read_text())


def test_a_diagnosis_of_programs_keeps_to_the_schema(ambiguous):
    check("diagnosis", ambiguous)
    assert tuple(ambiguous)[: len(CONTRACT)] == CONTRACT
    assert all(each["size_um"] < 0.3 * ambiguous["floor"]["um"] for each in ambiguous["minor"])
    assert ambiguous["outliers"] == []
    assert ambiguous["floor"] == {"um": ambiguous["gap"]["noise_floor_um"], "source": "rows"}
    assert ambiguous["next_experiment"]["minutes"] > 0


def test_a_study_of_axes_fills_the_same_keys(axis, ambiguous):
    told = json.loads(axis.to_json())
    check("diagnosis", told)
    for part in (lambda r: r, lambda r: r["where"], lambda r: r["gap"]):
        assert list(part(told)) == list(part(ambiguous))
    assert told["shrinkage"] is None  # one run: none is unseen
    assert told["next_experiment"]["moves"]["axis"] == "x" and told["next_experiment"]["minutes"] > 3.0
    assert told["causes"][-1]["effect"] == "unknown" and "2*pi*act_mm/15" in told["causes"][-1]["law"]["formula"]
    assert told["where"]["drivers"][0]["period_mm"] == pytest.approx(15.0, rel=0.01)
    assert told["axes_in_detail"]["x"]["force"]["mass_kg"]["ci95"][0] < 1.0


@pytest.mark.campaign  # test_claims has one in the plain run
def test_a_study_of_axes_with_unseen_runs_tells_how_far_the_gap_shrinks():
    runs = [axis_run(name, seed=k) for k, name in enumerate("abcd")]
    assert axis_study({"x": runs}).shrinkage.holdout == ("a", "b", "c", "d")
    assert axis_study({"x": runs[:2]}, holdout=["b"]).shrinkage.holdout == ("b",)
    assert axis_study({"x": runs[:2]}).shrinkage.holdout == ("a", "b")
    assert axis_study({"x": runs[:1]}).shrinkage is None


@pytest.mark.parametrize("verdict", ["none", "identified", "ambiguous", "unknown"])
def test_a_result_without_unseen_runs_is_told_and_drawn(verdict):
    alone = result(verdict).model_copy(update={"shrinkage": None})
    check("diagnosis", alone.as_json())
    told = "\n".join(answer_lines(alone))
    assert "an unseen one is not checked; the noise floor is 0.87" in told or verdict == "none"
    assert "goes from" not in told and "removed" not in told
    assert b"ladder" not in diagnosis_html(alone, [], title="e", machine="m")


def test_what_the_contract_foresees_has_its_place():
    term = LawTerm(term="sin(q)", value=1.0, ci95=(0.9, 1.1), unit="mm")
    law = Law(formula="a sin(q)", on="drive", terms=(term,), envelope={"q_rad": (0.0, 1.0)}, after_rms_um=1.0)
    cause = UnknownCause(target="x", probability=0.9, share=0.5, law=law)
    made = result("unknown").model_copy(
        update={"causes": (cause,), "floor": Floor(um=None, source="not identifiable"), "shrinkage": None}
    )
    check("diagnosis", made.as_json())
    assert made.known == ()


@pytest.mark.parametrize(
    "wrong", [{"floor": {"um": 1.0, "source": "a guess"}}, {"verdict": "sure"}, {"minor": None}, {"more": 1}]
)
def test_the_schema_refuses_what_the_type_refuses(wrong):
    told = {**result("unknown").as_json(), **wrong}
    assert not validator("diagnosis").is_valid(told)
    with pytest.raises(ValidationError):
        DiagnosisResult.model_validate(told)


def test_the_unknown_on_an_axis_is_named_where_its_rows_show_it():
    """A ripple of half the noise: in 12 s of rows, not in 4 s."""
    run = axis_run(ripple=3.0, noise=6.0)
    parts = {"time": run.time, "setpoint": run.setpoint, "encoder": run.encoder, "force": run.force}
    short, long = (
        axis_study({"x": [replace(run, **{name: values[:rows] for name, values in parts.items()})]})
        for rows in (500, 1500)
    )
    assert short.verdict != "unknown"
    assert long.verdict == "unknown" and long.causes[-1].probability > 0.99


def test_many_shapes_of_friction_make_it_no_less_probable_beside_something_unmodelled():
    """30 N of friction, and 20 N that swing and fade with the speed: these may imitate a part of it, in any of its shapes."""
    run = axis_run()
    speed = np.gradient(run.setpoint, run.time)
    swinging = 20.0 * np.sign(speed) * np.exp(-np.abs(speed) / 60.0) * np.cos(np.abs(speed) / 12.0)
    found = axis_study({"x": [replace(run, force=run.force + swinging)]})
    (friction,) = [c for c in found.causes if c.effect == "friction"]
    assert found.verdict == "unknown" and 0.5 < friction.probability < 0.8
