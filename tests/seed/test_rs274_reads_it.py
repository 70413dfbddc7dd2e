"""LinuxCNC's interpreter reads what compensate writes: same end points as the joint table, to its printed digits."""

import numpy as np
import pytest

from tests.commandline import ROOT, compensated
from tests.oracles.rs274 import needs_rs274, run

CASES = [
    ("samples/groove-circle-50.nc", "config/orthoglide-1deg.yaml"),
    ("samples/groove-circle-50.nc", "config/orthoglide.yaml"),
    ("samples/groove-circle-2.nc", "config/orthoglide-1deg.yaml"),
    ("samples/groove-circle-50.nc", "config/cartesian.yaml"),
    ("samples/groove-circle-50.nc", "config/puu.yaml"),
]


@needs_rs274
@pytest.mark.parametrize(("program", "config"), CASES)
def test_end_points_equal_the_joint_table(tmp_path, program, config):
    _, joints, _, _, corrected = compensated(tmp_path, program, config)
    read = run(corrected)
    assert not read.error
    ends = np.array([move.end for move in read.motions])
    written = np.column_stack((joints["xc_mm"], joints["yc_mm"], joints["zc_mm"]))
    assert len(ends) == len(written)
    assert np.abs(ends - written).max() <= 0.5e-4 + 1e-9


@needs_rs274
@pytest.mark.parametrize(("program", "config"), CASES[:1])
def test_every_programmed_end_point_of_the_original_has_a_row(tmp_path, program, config):
    _, joints, _, _, _ = compensated(tmp_path, program, config)
    rows = np.column_stack((joints["x_mm"], joints["y_mm"], joints["z_mm"]))
    for move in run((ROOT / program).read_bytes()).motions:
        assert np.abs(rows - move.end).max(axis=1).min() <= 0.5e-4
