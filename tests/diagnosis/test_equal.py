"""Causes that are indistinguishable in every log: known before the data, reported together, and told apart by the advice that follows."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from camcomp.api.diagnosis import diagnose
from camcomp.diagnosis.next_experiment.designed import propose
from camcomp.diagnosis.search.indistinguishable import classes
from camcomp.diagnosis.statistics.evidence import gram, misfit
from camcomp.diagnosis.statistics.normal_equations import sum_grams
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS
from tests.diagnosis.conftest import plan_of
from tests.validation.orthoglide.cases import EQUAL
from tests.validation.plants.further_run import add_run

FREE = plan_of(("servo_lag", None), design="both-ways", channels="tip", ratio=6.0)
LONG = plan_of(("tool_length", None), design="both-ways", channels="no-forces", ratio=8.0)


def named(causes):
    return [(c["effect"], c["target"]) for c in causes]


def alternatives(result):
    return {frozenset(named(one)) for one in result["alternatives"]}


def groups(design):
    candidates = design.columns.candidates
    return [{(candidates[i].name, candidates[i].target) for i in group} for group in classes(design)]


def follow(workshop, plan, tmp_path, candidate):
    """Applies a candidate; the result after it."""
    path, made = workshop.made(plan)
    folder = tmp_path / "again"
    shutil.copytree(path.parent, folder)
    without = ()
    if candidate.knows:
        [(effect, _, _)] = candidate.knows
        truth = made.truth
        entries = {
            "tool_length": f"  - {{effect: tool_length, length_mm: {truth.tool_mm:.5f}}}\n",
            "joint_offset": "".join(
                f"  - {{effect: joint_offset, target: {a}, offset_mm: {value:.5f}}}\n"
                for a, value in zip("xyz", truth.offset_mm, strict=True)
            ),
        }
        config = folder / "machine.yaml"
        config.write_text(config.read_text() + "\neffects:\n" + entries[effect])
        without = (effect,)
    else:
        channels = "no-forces" if plan.channels == "tip" and "encoder" in candidate.channels else plan.channels
        add_run(
            folder,
            made,
            plan,
            candidate.program,
            cutting=candidate.cutting,
            channels=channels,
            started_s=round(candidate.started, 1),
        )
    return diagnose(folder / "experiment.yaml", without).result.as_json()


@pytest.mark.campaign
def test_the_classes_are_known_without_residuals(workshop):
    """The same runs and channels with another fault, or none, have the same classes."""
    design = workshop.answer(LONG)[1].problem
    there = groups(design)
    assert {("tool_length", None), ("workpiece_frame", None)} in there
    for a in "xy":
        assert {("joint_offset", a), ("link_length", a)} in there
    assert groups(replace(design, white_residual=[0.0 * r for r in design.white_residual])) == there


@pytest.mark.campaign
def test_an_encoder_tells_a_lag_from_a_late_clock_before_anything_is_measured(workshop):
    there = groups(workshop.answer(LONG)[1].problem)
    assert not any(("servo_lag", None) in group for group in there)


@pytest.mark.campaign
def test_rows_of_a_member_in_its_own_direction_are_what_another_one_has_to_fit(workshop):
    """A workpiece that is turned and shifted in its plane is no long tool; one that is lifted is."""
    problem = workshop.answer(LONG)[1].problem
    frame, tool = (
        problem.member_columns((i,))
        for name in ("workpiece_frame", "tool_length")
        for i, a in enumerate(problem.columns.candidates)
        if a.name == name
    )

    def behind(theta):
        data = sum_grams([gram(W, W[:, frame] @ theta) for W in problem.white])
        return 0.5 * (misfit(data, problem.prior, tool) - misfit(data, problem.prior, frame))

    assert behind(np.array([0.0, 0.0, 1.0, 0.0])) < EQUAL_LOG_ODDS
    assert behind(np.array([1.0, 0.5, 0.0, 0.3])) > EQUAL_LOG_ODDS


@pytest.mark.campaign
def test_a_tip_alone_has_no_time_to_be_late_by(workshop):
    """Without set-points and encoders the time along the path is free: a lag shows only where it cuts a corner."""
    result = workshop.answer(FREE)[0]
    assert result["verdict"] == "none"
    assert result["gap"]["rms_um"] < 1.2 * result["gap"]["noise_floor_um"]


def swapped(one, true, other):
    return frozenset({*(one - {true}), other})


@pytest.mark.campaign
def test_a_long_tool_is_a_lifted_workpiece_until_somebody_measures_the_tool(workshop, tmp_path):
    result = workshop.answer(LONG)[0]
    assert result["verdict"] == "ambiguous"
    tool, frame = ("tool_length", None), ("workpiece_frame", None)
    assert tool in named(result["causes"])
    assert swapped(frozenset(named(result["causes"])), tool, frame) in alternatives(result)
    problem, job = workshop.answer(LONG)[1].problem, workshop.answer(LONG)[2].job
    pair = [
        problem.refit((i,)) for i, a in enumerate(problem.columns.candidates) if (a.name, a.target) in (tool, frame)
    ]
    candidate = propose(problem, pair, np.array([0.5, 0.5]), job).candidate
    assert "presetter" in candidate.action
    after = follow(workshop, LONG, tmp_path, candidate)
    assert not {tool, frame} & {*named(after["causes"]), *(m for one in alternatives(after) for m in one)}


@pytest.mark.campaign
@pytest.mark.parametrize("ratio", [3.0, 10.0])
@pytest.mark.parametrize(("true", "other", "design", "channels"), EQUAL)
def test_every_equal_pair_is_told_apart_by_following_the_advice(
    workshop, tmp_path, true, other, design, channels, ratio
):
    plan = plan_of(true, design=design, channels=channels, ratio=ratio, samples=150)
    result = workshop.answer(plan)[0]
    assert result["verdict"] == "ambiguous"
    assert {frozenset({true}), frozenset({other})} <= alternatives(result)
    after = follow(workshop, plan, tmp_path, workshop.answer(plan)[1].proposal.candidate)
    taken_out = "--without " + true[0] in result["next_experiment"]["action"]
    assert after["verdict"] == "none" if taken_out else named(after["causes"]) == [true]
