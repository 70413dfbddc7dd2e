"""No verdict contradicts its noise floor, whatever kind of study it is of."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.diagnosis.model.noise import StatedDeviation
from camcomp.diagnosis.result.floor_rule import within_floor
from camcomp.diagnosis.result.types import DiagnosisResult
from tests.contradictions import contradictions
from tests.report.diagnoses import result
from tests.studies import axis_study as study
from tests.unit.diagnosis.test_studies import axis_log

FLOOR = {"noise_floor_um": 0.87}


def changed(verdict, gap=None, unseen=None, **more):
    found = result(verdict).as_json()
    found["gap"] |= gap or {}
    if unseen:
        before, after = unseen
        found["shrinkage"] |= {"before_rms_um": before, "after_rms_um": after, "ratio": round(1 - after / before, 4)}
    return DiagnosisResult.model_validate(found | more)


@pytest.mark.parametrize("verdict", ["identified", "ambiguous", "unknown"])
def test_a_gap_below_the_floor_is_none_and_claims_no_shrinkage(verdict):
    low = changed(verdict, {"rms_um": 0.8, "p95_um": 0.9, "max_um": 1.0}, (0.8, 0.5))
    assert contradictions(low.as_json())
    found = within_floor(low)
    assert found.verdict == "none" and found.causes == () and contradictions(found.as_json()) == []
    assert found.shrinkage.after_rms_um == found.shrinkage.before_rms_um == 0.8 and found.shrinkage.ratio == 0.0


@pytest.mark.parametrize(("probability", "word"), [(0.95, "identified"), (0.6, "ambiguous")])
def test_what_is_left_below_the_floor_is_no_unknown(probability, word):
    left = changed("unknown", unseen=(14.1, 0.7))
    known = [{**each.as_json(), "probability": probability} for each in left.known]
    causes = [*known, *(each.as_json() for each in left.causes if each.effect == "unknown")]
    left = DiagnosisResult.model_validate(left.as_json() | {"causes": causes})
    assert contradictions(left.as_json())
    found = within_floor(left)
    assert found.verdict == word and contradictions(found.as_json()) == []
    assert [c.effect for c in found.causes] == [c["effect"] for c in known]


def test_without_a_cause_it_stays_open_whether_anything_is_there():
    nothing = changed("unknown", unseen=(14.1, 0.7))
    nothing = nothing.model_copy(update={"causes": tuple(c for c in nothing.causes if c.effect == "unknown")})
    found = within_floor(nothing)
    assert found.verdict == "ambiguous" and contradictions(found.as_json()) == []


def test_forces_show_what_no_position_does():
    low = {"rms": 0.5, "floor": 0.9, "unit": "um"}
    at_floor = changed("unknown", {"rms_um": 0.8, "actuators": {"x": low}})
    assert within_floor(at_floor) == at_floor
    left = changed("unknown", {"actuators": {"x": {**low, "rms": 14.0}}}, (14.1, 0.7))
    assert within_floor(left, in_forces=True) == left and within_floor(left) != left


@pytest.mark.parametrize("verdict", ["none", "identified", "ambiguous", "unknown"])
def test_what_is_above_the_floor_stays_as_it_is(verdict):
    assert within_floor(result(verdict)) == result(verdict)


def test_axes_that_are_quieter_than_stated_do_not_hide_another_one():
    """1.2 um in x; 1 um is stated for each of three axes, of which two have 0.1 um."""
    log = axis_log(lag=0.0, step=0.02)
    speed, rng = np.gradient(log.encoder, log.time), np.random.default_rng(1)

    def axis(um, lag_ms):
        error = 1e-3 * lag_ms * speed + 1e-3 * um * rng.standard_normal(len(speed))
        return replace(log, setpoint=log.encoder + error, force=np.full(len(speed), np.nan))

    told = study(
        {"x": [axis(0.1, 0.013)], "y": [axis(0.1, 0.0)], "z": [axis(0.1, 0.0)]},
        stated=StatedDeviation(encoder_mm=1e-3, force_N=1.0),
    )
    assert told.gap.rms_um < 1e3 * np.sqrt(3.0) * 1e-3
    assert [(c.effect, c.target) for c in told.causes][:1] == [("servo_lag", "x")]
