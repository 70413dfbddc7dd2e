"""The groove of 50 mm of the compensation paper, end to end: figures of the size the paper prints."""

import numpy as np
import pytest

from tests.commandline import camcomp, compensated


@pytest.fixture(scope="module")
def groove(tmp_path_factory):
    folder = tmp_path_factory.mktemp("groove")
    return compensated(folder, "samples/groove-circle-50.nc", "config/orthoglide-1deg.yaml")


def test_error_before_is_that_of_the_reference_machine_and_after_within_tolerance(groove):
    done, _, _, summary, _ = groove
    assert done.returncode == 0
    # 24 points of an independent energy minimisation give 1.148 mm; more points find a little more
    assert 1148.0 <= summary["before"]["max_um"] <= 1150.0
    assert summary["after"]["max_um"] <= 1.0


def test_actuators_change_and_drives_push_as_the_paper_says(groove):
    _, joints, _, summary, _ = groove
    assert 0.5 <= summary["actuator_change_max_mm"] <= 1.7
    assert 250.0 <= summary["actuator_force_max_N"] <= 400.0
    change = max(np.abs(joints[f"act_{a}_mm"] - joints[f"act_{a}_nominal_mm"]).max() for a in "xyz")
    assert change == pytest.approx(summary["actuator_change_max_mm"], abs=1e-6)


def test_every_programmed_end_point_has_its_row(groove):
    _, joints, _, _, _ = groove
    rows = np.column_stack([joints["line"], joints["x_mm"], joints["y_mm"], joints["z_mm"]])
    for line, point in [(7, (25, 0, 5)), (8, (25, 0, 0)), (9, (25, 0, 0)), (10, (25, 0, 5))]:
        hit = (rows[:, 0] == line) & (np.abs(rows[:, 1:] - point).max(axis=1) < 1e-6)
        assert hit.any(), (line, point)


def test_the_cut_is_entered_and_left_by_one_joining_line(groove):
    _, joints, _, summary, _ = groove
    same = (np.diff(joints["x_mm"]) == 0) & (np.diff(joints["y_mm"]) == 0) & (np.diff(joints["z_mm"]) == 0)
    jump = np.abs(np.diff(joints["xc_mm"])) + np.abs(np.diff(joints["yc_mm"])) > 0.1
    assert (same & jump).sum() == 2 == summary["joining_lines"]


def test_a_second_pass_is_refused_and_writes_nothing(groove, tmp_path):
    (tmp_path / "again.nc").write_bytes(groove[4])
    done = camcomp("compensate", tmp_path / "again.nc", "--config", "config/orthoglide-1deg.yaml", "-o", tmp_path / "x")
    assert done.returncode == 1 and b"CC603" in done.stderr
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("method", ["stiffness", "fixed-point"])
def test_the_paper_s_equations_4_and_5_find_the_same_correction(groove, tmp_path, method):
    _, joints, _, summary, _ = compensated(
        tmp_path, "samples/groove-circle-50.nc", "config/orthoglide-1deg.yaml", "--method", method
    )
    assert summary["method"] == method and summary["after"]["max_um"] <= 1.0
    np.testing.assert_allclose(joints["xc_mm"], groove[1]["xc_mm"], atol=1.1e-4)


def test_the_linear_baseline_leaves_what_the_paper_is_about(tmp_path):
    done, _, _, summary, _ = compensated(
        tmp_path, "samples/groove-circle-50.nc", "config/orthoglide-1deg.yaml", "--method", "linear"
    )
    assert done.returncode == 1 and b"CC601" in done.stderr
    assert summary["after"]["max_um"] > 500.0
