"""Measured forces are taken as they are, whatever effects say of the modelled ones."""

import json

import numpy as np
import pytest

from camcomp.compensation.set_points.stream import Stream
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from tests.commandline import ROOT, table
from tests.validation.runner import invoke

CARTESIAN = ROOT / "config" / "cartesian.yaml"
PROGRAM = "G21 G90 G17\nS6000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F300\nG1 X5 F600\nM30\n"
EFFECTS = {
    "cutting_force": {"effect": "cutting_force", "factor": 2.0},
    "tool_wear": {"effect": "tool_wear", "growth_per_min": 10.0},
}


def rows(tmp_path, effect, force=None):
    """Forces along Y and drive forces y of the row at the end of the cut."""
    (tmp_path / "p.nc").write_text(PROGRAM)
    settings = {"effects": [EFFECTS[effect]], **({"process": {"force": force}} if force else {})}
    (tmp_path / "e.yaml").write_text(json.dumps(settings))
    words = ["--config", str(CARTESIAN), "--config", str(tmp_path / "e.yaml"), "--joints", str(tmp_path / "j.csv")]
    code, said = invoke(["compensate", str(tmp_path / "p.nc"), *words, "-o", str(tmp_path / "out.nc")])
    assert code == 0, said
    columns = table(tmp_path / "j.csv")
    return columns["fy_N"], columns["act_y_N"]


def test_the_stream_takes_a_force_as_measured(tmp_path):
    (tmp_path / "e.yaml").write_text(json.dumps({"effects": [EFFECTS["cutting_force"]]}))
    stream = Stream(Job(load_config([str(CARTESIAN), str(tmp_path / "e.yaml")])))
    assert stream.correct((1.0, 2.0, 0.0), (0.0, -215.0, 0.0)).drive[1] == pytest.approx(215.0)


@pytest.mark.parametrize("effect", EFFECTS)
def test_rows_of_a_modelled_force_are_in_equilibrium(tmp_path, effect):
    force, drive = rows(tmp_path, effect)
    assert np.abs(force).max() > 216.0
    np.testing.assert_allclose(drive, -force, atol=1e-5)


@pytest.mark.parametrize("effect", EFFECTS)
def test_a_force_table_is_taken_as_measured(tmp_path, effect):
    (tmp_path / "force.csv").write_text(
        "line,s_mm,fx_N,fy_N,fz_N\n4,0,0,0,0\n4,11,0,0,0\n5,11,0,-215,0\n5,16,0,-215,0\n"
    )
    force, drive = rows(tmp_path, effect, {"model": "table", "file": str(tmp_path / "force.csv")})
    assert np.abs(force).max() == pytest.approx(215.0)
    np.testing.assert_allclose(drive, -force, atol=1e-5)
