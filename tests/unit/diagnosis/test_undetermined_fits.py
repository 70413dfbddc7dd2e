"""Rows that do not determine a fit are refused in words of logs, whatever the linear algebra says."""

import numpy as np
import pytest

from camcomp.diagnosis import studies
from camcomp.ground.errors import ConfigError

CONFIG = "config/cartesian.yaml"
HEADS = {"study_axes": "t_s,cmd_x_mm,act_x_mm", "study_arm": "t_s,act_x_mm,act_y_mm,act_z_mm,x_mm,y_mm,z_mm"}


@pytest.mark.parametrize("name", HEADS)
def test_a_singular_fit_names_the_rows_and_no_minor(tmp_path, monkeypatch, name):
    def singular(*given, **named):
        raise np.linalg.LinAlgError("17-th leading minor of the array is not positive definite")

    monkeypatch.setattr(studies, name, singular)
    rows = np.column_stack([np.arange(40.0), *[np.sin(np.arange(40.0))] * HEADS[name].count(",")])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header=HEADS[name], comments="")
    file = tmp_path / "e.yaml"
    file.write_text(f"config: [{studies.Path(CONFIG).absolute()}]\nruns: [{{name: a, log: a.csv, cutting: false}}]\n")
    with pytest.raises(ConfigError) as caught:
        studies.study_of(file)
    assert caught.value.rule == "CC420" and "the rows do not determine the fit" in str(caught.value)
    assert "minor" not in str(caught.value)
