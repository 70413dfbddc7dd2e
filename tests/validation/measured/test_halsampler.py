"""What LinuxCNC's halsampler -t wrote while its planner drove corner.nc (G64, 3 m/min, 1 kHz): set-points and feedback of
its three joints, which follows one cycle behind, and the line.
"""

from pathlib import Path

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from tests.importing import imported

FOLDER = Path(__file__).parent / "halsampler"
PINS = "cmd_x_mm cmd_y_mm cmd_z_mm act_x_mm act_y_mm act_z_mm line"


def test_the_planner_s_motion(tmp_path, capsys):
    words = ("--columns", PINS, "--program", FOLDER / "corner.nc")
    got = imported(capsys, tmp_path / "x", FOLDER / "corner.sam", *words, config="cartesian")
    assert got.code == 0, got.told
    log = got.logs["corner"]
    assert len(log["t_s"]) == 591 and log["t_s"] == pytest.approx(0.001 * np.arange(591))
    assert [log[f"cmd_{a}_mm"][-1] for a in "xyz"] == [8, 5, 2]
    assert log["act_x_mm"][1:] == pytest.approx(log["cmd_x_mm"][:-1], abs=1e-6)
    assert np.max(np.abs(np.diff(log["cmd_x_mm"]))) == pytest.approx(50 * 0.001, abs=1e-5)  # F3000
    assert set(log["line"]) == {0, 4, 5, 6, 7}
    opened = open_experiment(tmp_path / "x/experiment.yaml")
    assert [run.name for run in opened.runs] == ["corner"] and opened.notes == ()


def test_bare_pins_by_number(tmp_path, capsys):
    words = [
        w for k, a in enumerate("xyz", 2) for w in ("--column", f"cmd_{a}_mm={k}", "--column", f"act_{a}_mm={k + 3}")
    ]
    got = imported(capsys, tmp_path / "x", FOLDER / "corner.sam", *words, config="cartesian")
    assert got.code == 0 and [got.logs["corner"][f"act_{a}_mm"][-1] for a in "xyz"] == [8, 5, 2]
    assert "1 column dropped: 8" in got.told
