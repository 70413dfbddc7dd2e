"""How far the gap shrinks: step by step to near the noise floor, and with what was re-fitted named."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from camcomp.api.diagnosis import diagnose
from tests.diagnosis.test_poor_input import PLAN
from tests.validation.plants.further_run import add_run


@pytest.mark.campaign  # the same of poses is in the plain run
def test_the_frame_of_another_clamping_is_refitted_on_the_held_out_run_and_named(workshop, tmp_path):
    path, made = workshop.made(PLAN)
    folder = tmp_path / "experiment"
    shutil.copytree(path.parent, folder)
    moved = replace(made.truth, shift_mm=made.truth.shift_mm + np.array([0.2, -0.1, 0.05]))
    program = made.programs[0]
    add_run(folder, made, PLAN, program, cutting=True, channels="all", started_s=9000.0, truth=moved)
    file = folder / "experiment.yaml"
    text = file.read_text().replace("started_s: 9000.0}", "started_s: 9000.0, clamping: second}")
    file.write_text(text + "holdout: [run-3]\n")
    found = diagnose(file).result.shrinkage.as_json()
    assert found["holdout"] == ["run-3"]
    assert found["refitted"] == ["workpiece frame of run-3 (clamping second)"]
    assert found["before_rms_um"] < 40.0  # the 230 um of the clamping are no part of the gap
    assert found["ratio"] > 0.5
