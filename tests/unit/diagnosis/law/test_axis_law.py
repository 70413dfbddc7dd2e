"""The residual of an axis becomes a formula: each way of its own, in the drive force and in the following error."""

import re

import numpy as np
import pytest

from camcomp.diagnosis.axis.findings import AxisRun
from camcomp.diagnosis.axis.law import AxisRows, axis_law
from camcomp.diagnosis.axis.study import studied
from camcomp.diagnosis.axis.terms import travel
from camcomp.diagnosis.law.bench_terms import Term
from camcomp.diagnosis.law.describe import law_result
from camcomp.diagnosis.law.find import fitted
from camcomp.diagnosis.law.forms import at_drive
from camcomp.diagnosis.law.library import LearnedLaw
from camcomp.diagnosis.law.shapes import Shapes
from camcomp.diagnosis.statistics.folds import usual_split
from camcomp.model.law.covariates import AT_DRIVE
from camcomp.model.law.expression import parse

PERIOD_MM, LAG_S, LOOP_MM_PER_N = 4.0, 0.004, 1e-3
FORWARD_N, BACKWARD_N = 2.0, 3.0


def axis_run(ripple, seed=0):
    """An axis whose screw pushes back by a force that differs between the ways, which its control lets through."""
    t = np.arange(0.0, 16.0, 2e-3)
    rng = np.random.default_rng(seed)
    speed = 40.0 * np.tanh(4.0 * np.sin(1.2 * t))
    setpoint, push = np.cumsum(speed) * 2e-3, np.gradient(speed, t)
    at = setpoint - LAG_S * speed
    ways = np.where(speed > 0, FORWARD_N, BACKWARD_N)
    screw = ripple * ways * np.sin(2 * np.pi * at / PERIOD_MM + np.where(speed > 0, 0.0, 1.0))
    force = 0.004 * push + 20.0 * np.tanh(speed / 5.0) + 0.1 * speed + screw + 0.2 * rng.standard_normal(len(t))
    encoder = at - LOOP_MM_PER_N * screw + 2e-4 * rng.standard_normal(len(t))
    return AxisRun(name="r", time=t, setpoint=setpoint, encoder=encoder, force=force), screw


@pytest.fixture(scope="module")
def found():
    run, screw = axis_run(1.0)
    result, (axis,) = studied({"x": [run]})
    return run, screw, result, axis


def test_a_ripple_comes_out_with_its_period_and_both_ways(found):
    _, _, result, _ = found
    law = result.law
    assert result.verdict == "unknown" and law.on == "drive"
    forces = [each for each in law.terms if each.term.startswith("force x") and each.unit == "N"]
    assert len(forces) == 4 and all(
        abs(float(re.search(r"mm/([\d.]+)", each.term)[1]) - PERIOD_MM) < 0.01 for each in forces
    )
    assert np.hypot(forces[0].value, forces[1].value) == pytest.approx(FORWARD_N, rel=0.05)
    assert np.hypot(forces[2].value, forces[3].value) == pytest.approx(BACKWARD_N, rel=0.05)
    assert all(low < each.value < high for each in law.terms for low, high in [each.ci95])


def test_what_the_following_error_shows_of_it_goes_into_a_machine_file(found):
    run, screw, result, _ = found
    (part,) = result.law.parts
    assert (part.stage, part.target) == ("control", "x") and set(part.envelope) == {"act_mm"}
    said = parse(part.formula, dict.fromkeys(AT_DRIVE))({"act_mm": run.setpoint}, len(run.time))
    left = said + LOOP_MM_PER_N * screw
    assert np.sqrt(np.mean(left[200:] ** 2)) < 0.3 * LOOP_MM_PER_N * np.sqrt(np.mean(screw**2))
    assert result.law.after_rms_um < 0.5 * result.law.before_rms_um
    kept = LearnedLaw("law_x", "lathe", result.law)
    assert len(kept.pieces()) == 4  # a force cannot be put to work
    assert kept.candidate(("x",)) is not None and kept.candidate(("y",)) is None


def test_nothing_is_left_where_nothing_is_wrong():
    run, _ = axis_run(0.0)
    result, (axis,) = studied({"x": [run]})
    assert result.law is None
    (moved,) = [r.move for r in axis.following.fitted]
    told = travel(run.time, run.setpoint, axis.wide).of(np.isin(run.time, moved.time))
    assert axis_law("x", axis.force, axis.following, [told]) is None


def test_an_axis_that_stands_has_no_law():
    rng = np.random.default_rng(1)
    t = np.arange(0.0, 4.0, 2e-3)
    still = np.full(len(t), 12.5)
    force = 3.0 + 5.0 * np.sin(9.0 * t) + 0.2 * rng.standard_normal(len(t))
    result, _ = studied({"x": [AxisRun(name="r", time=t, setpoint=still, encoder=still, force=force)]})
    assert result.law is None


@pytest.mark.parametrize("held", [True, False])
def test_a_law_of_a_machine_file_takes_no_size_that_only_other_causes_would_undo(found, held):
    """What a power of the speed adds beside a lag that may change leaves more than before where the lag stays as it is."""
    following = found[3].following
    rows = AxisRows("x", following, [each.move for each in following.fitted], force=False, held=held)
    forms = [f for f in at_drive(rows.sizes(rows.spot), False) if f.about == ("act_mm_per_s",)]
    worse = []
    for form in forms:
        law = fitted(Shapes(rows), [Term(rows.spot, form)], rows.folds(usual_split(1)))
        move = rows.moves[0]
        at = {"act_mm": move.position, "act_mm_per_s": move.speed, "act_mm_per_s2": move.acceleration}
        said = parse(law_result(rows, law, 1.0, 1.0).parts[0].formula, dict.fromkeys(AT_DRIVE))(at, len(move.time))
        worse.append(np.std(rows.left[0] - said) / np.std(rows.left[0]))
    assert len(worse) > 2 and (max(worse) < 1.001) == held
