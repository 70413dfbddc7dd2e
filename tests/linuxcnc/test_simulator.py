"""The HAL component of samples/linuxcnc in LinuxCNC's own simulator, without a screen, joints read back through HAL."""

import tempfile
from pathlib import Path

import numpy as np
import pytest

from camcomp.compensation.set_points.stream import Stream
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from tests.linuxcnc import simulator

pytestmark = simulator.needs_linuxcnc
CONFIG = shipped("config/cartesian.yaml")
STEPS = [  # all three coordinates, arcs by radius and from their start: behind a recovery axes stand where offsets led
    ("G21 G90 G0 X0 Y0 Z0", (0.0, 0.0, 0.0)),
    ("G0 X10 Y5 Z-2", (0.0, 0.0, 0.0)),
    ("G1 X12 Y5 Z-2 F600", (-400.0, 300.0, -800.0)),
    ("G1 X-20 Y8.5 Z1 F2000", (215.0, -10.0, -25.0)),
    ("G1 X-20 Y8.5\nG2 X-20 Y-8.5 Z1 R10", (1000.0, 2000.0, 4000.0)),
    ("G0 X0 Y0 Z1", (0.0, 0.0, 0.0)),
]
REFUSED = [
    ("G0 X199.95", (-2000.0, 0.0, 0.0)),  # the correction of 0.1 mm leads beyond the soft limit of 200 mm
    ("T1 M6 G43", (0.0, 0.0, 0.0)),
    ("T2 M6 G43", (0.0, 0.0, 0.0)),
]
TOOLS = "T1 P1 X3 Z10 ;\nT2 P2 Z-5 ;\n"


def test_the_joints_go_where_camcomp_sends_them():
    with tempfile.TemporaryDirectory() as name:  # another user can reach it, unlike that of pytest
        simulator.machine(Path(name), CONFIG, TOOLS)
        seen, said = simulator.simulate(Path(name), "steps", steps=STEPS, refused=REFUSED)
    assert "error" not in seen, f"{seen}\n{said}"
    stream = Stream(Job(load_config([CONFIG])))
    programmed = [(0, 0, 0), (10, 5, -2), (12, 5, -2), (-20, 8.5, 1), (-20, -8.5, 1), (0, 0, 1)]
    largest = 0.0
    for row, tip, (code, force) in zip(seen["rows"], programmed, STEPS, strict=True):
        point = stream.correct(tip, force)
        assert np.abs(np.array(row["joints"]) - point.actuators).max() <= 1.01e-4, (code, row)  # a count is 0.1 um
        assert np.array(row["drive"]) == pytest.approx(point.drive, abs=1e-3)
        largest = max(largest, np.abs(np.array(row["joints"]) - tip).max())
    assert seen["refused"] == [True] * len(REFUSED), said
    assert largest == pytest.approx(0.1, abs=1e-3)  # 2000 N against 20 000 N/mm
