"""Work offsets and machine coordinates of a turned workpiece: where LinuxCNC's interpreter goes, in machine coordinates."""

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.gcode.setup import Setup
from tests.oracles.rs274 import needs_rs274, run

G54, HOME = (10.0, 20.0, 3.0), (200.0, 300.0, 50.0)
PROGRAM = """G21 G90 G17
G10 L2 P1 X10 Y20 Z3{R}
G10 L2 P2 X110 Y20 Z0{R}
G54 G0 X1 Y2 Z5
G1 Z0 F500
X5
G0 Z5
G55 G0 X3 Y4
G53 G0 X40 Y7 Z7
G91 G0 X5
G90
G92 X1 Y1
G0 X3 Y3
G28 X0 Y0 Z5
G0 X1 Y1 Z5
G53 G0 X40
G0 X2
G10 L20 P2 X3
G0 X4 Y4
G92.1
G54 G0 X4 Y4
G28 X1 Y1 Z1
G0 X1 Y1 Z1
G53 G0 Y15
M30
"""


def rotation(turn_deg):
    """Program axes in machine axes, about Z."""
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@needs_rs274
@pytest.mark.parametrize("turn_deg", [0.0, 30.0, 90.0, -137.0])
def test_offsets_of_a_turned_workpiece_lead_where_linuxcnc_goes(turn_deg):
    said = run(PROGRAM.replace("{R}", f" R{turn_deg:g}"), homes={28: HOME})
    assert not said.error
    R = rotation(turn_deg)
    turned = tuple(tuple(float(each) for each in row) for row in R)
    setup = Setup(offsets={"G54": G54}, home_mm=HOME, rotation=turned)
    read = read_program(PROGRAM.replace("{R}", "").encode(), name="p.nc", setup=setup).path
    machine = np.array(G54) + read.end @ R.T
    np.testing.assert_allclose(
        machine, [each.machine for each in said.motions], atol=3e-4
    )  # four decimals, homes in inches
