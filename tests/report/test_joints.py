"""The joints' part of a report: what is drawn is what was found, and nothing where no pose was."""

import numpy as np
import pytest

from camcomp.diagnosis.report.joints import joints_section
from camcomp.diagnosis.result.types import CurveCause, ErrorCurve, Estimate
from tests.report import diagnoses

ANGLE = np.arange(0.0, 360.0, 3.0)


def found():
    seen = (ANGLE >= 30.0) & (ANGLE <= 120.0)
    error = np.where(seen, 2e-4 * np.sin(np.radians(8.0 * ANGLE)), 0.0)
    curve = ErrorCurve(
        angle_deg=tuple(ANGLE), error_rad=tuple(error), sd_rad=tuple(np.where(seen, 1e-5, 3e-4)),
        seen_deg=((30.0, 120.0),), seen_share=0.25,
    )  # fmt: skip
    cause = CurveCause(
        effect="joint_curve", target="elbow", probability=0.99, share=0.5, curve=curve,
        parameters={"amplitude_rad": Estimate(value=1e-4, ci95=(0.9e-4, 1.1e-4))},
    )  # fmt: skip
    result = diagnoses.result("identified")
    shrinkage = result.shrinkage.model_copy(update={"holdout": ("b",), "covered_share": 0.4, "covered_rms_um": 12.0})
    return result.model_copy(update={"causes": (cause,), "shrinkage": shrinkage})


def test_a_joint_is_drawn_with_its_band_and_only_where_it_was_seen():
    section = joints_section(found())
    low, high, curve, marks = section.figures[0].traces
    y = np.array([np.nan if v is None else v for v in curve["y"]])
    x = np.array(curve["x"])
    inside = (x >= 30.0) & (x <= 120.0)
    np.testing.assert_allclose(y[inside], 200.0 * np.sin(np.radians(8.0 * x[inside])), atol=0.01)
    assert np.isnan(y[~inside]).all()
    assert np.array(marks["x"]) == pytest.approx(x[inside])
    width = np.array(high["y"]) - np.array(low["y"])
    assert width[~inside] == pytest.approx(2 * 1.96 * 300.0, abs=0.3)
    assert "40 % of the unseen poses" in section.text[1]
    assert section.tables[0].rows[0][:4] == ["elbow", "100", "90 to 110", "25 %"]


def test_without_curves_there_is_no_such_part():
    assert joints_section(found().model_copy(update={"causes": ()})) is None
