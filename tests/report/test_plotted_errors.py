"""The plots of the compensation page agree with its headline and the summary, for every kind of model."""

import json

import numpy as np
import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.totals import Totals
from camcomp.compensation.report.figures import DrawnPath, figure_error
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of
from camcomp.model.job import Job
from camcomp.report.plot import brief

TEXT = "G21 G90 G17\nG0 X20 Y0 Z5\nG1 Z0 F300\nG3 X20 Y0 I-8 J0 F600\nG1 X0 Y10\nG0 Z5\nM30\n"
EFFECTS = [
    {"effect": "backlash", "target": "x", "width_mm": 0.02},
    {"effect": "screw_cyclic", "target": "y", "amplitude_mm": 0.01, "pitch_mm": 5.0, "phase_rad": 0.3},
    {"effect": "tool_deflection", "compliance_mm_per_N": 1e-4},
]


@pytest.mark.parametrize("effects", [[], EFFECTS])
def test_the_plotted_error_is_that_of_the_summary(tmp_path, effects):
    (tmp_path / "effects.yaml").write_text(json.dumps({"effects": effects}))
    job = Job(load_config([shipped("config/orthoglide-1deg.yaml"), str(tmp_path / "effects.yaml")]))
    program = program_of(TEXT.encode(), "p.nc", job.config)
    result = compensate(program, job, method="newton", tolerance_um=1.0, version="0")
    figures, drawn = Totals.of(result, job).summary().as_json(), DrawnPath(result, job)
    for name in ("before", "after"):
        shown = getattr(drawn, name)[~drawn.hidden]
        assert shown.max() == pytest.approx(figures[name]["max_um"], rel=1e-12)
        assert np.isfinite(shown).all() and (shown > 0.0).all()
    plot = figure_error(drawn, 1.0)
    assert f"corrected program up to {brief(figures['after']['max_um'])} µm" in plot.caption
