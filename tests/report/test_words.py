"""A diagnosis in the words of a workshop."""

import pytest

from camcomp.diagnosis.report.answer import MOST_CAUSES, answer_lines
from camcomp.diagnosis.report.words import depends, percent, plain, remedy, shortened, size, sizes, term_size
from camcomp.diagnosis.result.types import DiagnosisResult, Driver, Estimate, FoundCause, LawTerm
from camcomp.ground import shelf
from camcomp.report.plot import micrometres
from tests.report.diagnoses import cause, result

OWN = [name for name in shelf.members("effects") if getattr(shelf.load("effects", name), "PARAMETERS", ())]


def found(effect, target=None, share=0.5, probability=0.99, **parameters):
    values = {name: {"value": v, "ci95": [lo, hi]} for name, (v, lo, hi) in parameters.items()}
    return FoundCause.model_validate(
        {"effect": effect, "target": target, "probability": probability, "share": share, "parameters": values}
    )


@pytest.mark.parametrize("name", OWN)
def test_every_effect_says_what_it_is_and_what_helps(name):
    """The formula and the map of an unknown effect have no remedy that is known before they are found."""
    effect = shelf.load("effects", name)
    assert effect.PLAIN and not effect.PLAIN.endswith(".")
    assert effect.REMEDY and not effect.REMEDY.endswith(".")
    each = found(name)
    assert plain(each) == effect.PLAIN and remedy(each) == effect.REMEDY


def test_an_effect_of_another_installation_has_its_name_alone():
    assert plain(found("spindle_growth")) == "spindle growth" and remedy(found("spindle_growth")) == ""


@pytest.mark.parametrize(
    ("value", "low", "high", "told"),
    [
        (0.0243949, 0.0232628, 0.025527, "width 24.4 µm (23.3 to 25.5)"),
        (0.0243949, 0.02438, 0.02441, "width 24.395 µm (24.380 to 24.410)"),
        (1.5, 1.2, 1.8, "width 1.50 mm (1.20 to 1.80)"),
        (0.0004, 0.0, 0.0012, "width 0.40 µm (0.00 to 1.20)"),
    ],
)
def test_digits_follow_the_interval(value, low, high, told):
    assert sizes(found("backlash", "x", width_mm=(value, low, high))) == told


def test_only_an_improbable_cause_is_not_determined():
    may_be_one = found("cutting_force", factor=(1.02, 0.98, 1.06))
    assert sizes(may_be_one) == "factor 1.020 (0.980 to 1.060)"
    assert sizes(may_be_one.model_copy(update={"probability": 0.4})) == "factor not determined (0.980 to 1.060)"


def test_a_factor_is_written_with_its_interval():
    assert sizes(found("cutting_force", factor=(1.30, 1.28, 1.32))) == "factor 1.300 (1.280 to 1.320)"


def test_small_compliances_have_no_powers_of_ten():
    soft = found("gravity_compliance", "elbow", compliance_rad_per_Nmm=(9.36e-9, 7.65e-9, 1.11e-8))
    assert sizes(soft) == "compliance 9.4 µrad/Nm (7.7 to 11.1)"
    bent = found("tool_deflection", compliance_mm_per_N=(0.00012, 0.0001, 0.00014))
    assert sizes(bent) == "compliance 0.120 µm/N (0.100 to 0.140)"


def test_a_unit_stands_once():
    assert sizes(found("tool_wear", growth_per_min=(0.205, 0.136, 0.274))) == "growth 0.205 1/min (0.136 to 0.274)"


def test_a_phase_may_be_zero_and_is_told():
    text = sizes(found("screw_cyclic", "x", amplitude_mm=(0.004, 0.0035, 0.0045), phase_rad=(0.1, -0.1, 0.3)))
    assert "phase" in text and "phase not determined" not in text


def test_parameters_that_may_be_nothing_come_last_by_name():
    frame = found("workpiece_frame", shift_x_mm=(0.05, 0.04, 0.06), shift_y_mm=(0.001, -0.002, 0.004),
                  shift_z_mm=(0.0, -0.003, 0.003))  # fmt: skip
    assert sizes(frame) == "shift x 50 µm (40 to 60); shift y and shift z not determined"


def test_a_parameter_of_an_unknown_unit_is_told_as_it_stands():
    assert size("strength", Estimate(value=2e-9, ci95=(1e-9, 3e-9))) == "strength 2.00e-09 (1.00e-09 to 3.00e-09)"


def test_small_lengths_and_shares():
    assert micrometres(1.42e-9) == "below 0.01 µm" and micrometres(3.094) == "3.09 µm"
    assert percent(0.002) == "less than 1 %" and percent(0.0) == "0 %" and percent(0.976) == "98 %"


def test_what_a_gap_depends_on():
    assert depends(Driver(covariate="reversal:x", share=0.9)) == "the reversals of x"


def test_ten_lines_at_most_and_no_cause_of_nothing():
    many = [cause("backlash", a, 0.99, 0.2, width_mm=0.02) for a in "xyz"]
    many += [cause("joint_offset", a, 0.99, 0.001, offset_mm=0.02) for a in "xyz"]
    full = DiagnosisResult.model_validate(result("ambiguous").model_dump() | {"verdict": "identified", "causes": many})
    lines = answer_lines(full)
    assert len(lines) <= 10
    assert sum("do: " in each for each in lines) == MOST_CAUSES
    assert "  and 3 more with less than 1 % of the gap together" in lines
    assert not any(" 0 %" in each for each in lines)


def test_nothing_is_to_be_done_while_the_cause_is_open():
    lines = answer_lines(result("ambiguous"))
    assert not any("do: " in each for each in lines) and any("measure next" in each for each in lines)


def test_an_unknown_effect_says_what_it_goes_with():
    assert "The rest of y depends on the reversals of x." in answer_lines(result("unknown"))[0]


LAW = "tip y = 0.0466387*gauss((x_mm + 5.15967)/6.00183)"


def test_a_law_has_the_digits_that_its_interval_allows():
    assert shortened(LAW) == "tip y = 0.04664*gauss((x_mm + 5.16)/6.002)"
    term = LawTerm(term="gauss((x_mm + 5.15967)/6.00183)", value=0.0466387, ci95=(0.0450, 0.0482), unit="mm")
    assert term_size(term) == "gauss((x_mm + 5.16)/6.002): 46.6 µm (45.0 to 48.2)"


def test_ten_lines_at_most_with_a_law_too():
    term = {"term": "x_mm", "value": 0.02, "ci95": [0.01, 0.03], "unit": "1/mm"}
    law = {"formula": LAW, "on": "structure", "terms": [term] * 3, "envelope": {"x_mm": [-20, 20]}, "after_rms_um": 2.9,
           "before_rms_um": 17.4, "says": "What is left is a bump."}  # fmt: skip
    many = [cause("backlash", a, 0.99, share, width_mm=0.02) for a, share in zip("xyz", (0.1, 0.2, 0.3), strict=True)]
    many.append({"effect": "unknown", "target": "y", "probability": 0.99, "share": 0.4, "parameters": {}, "law": law})
    lines = answer_lines(DiagnosisResult.model_validate(result("unknown").model_dump() | {"causes": many}))
    assert len(lines) <= 10
    assert lines[1].startswith("  backlash (z)"), "the one with most of the gap is told"
    assert any("What is left is a bump." in each for each in lines) and "measure next" in lines[-1]
