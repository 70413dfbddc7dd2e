"""Pecks of G73: how far the tool backs off."""

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.ground.datatypes import RAPID

HOLES = {
    "rs274": b"G20 G90 G0 X0 Y0 Z1\nG73 X0 Y0 Z-0.5 R0.1 Q0.3 F5\nG80\nM2\n",
    "fanuc": b"%\nO1\nG20 G90 G0 X0. Y0. Z1.\nG73 X0. Y0. Z-0.5 R0.1 Q0.3 F5.\nG80\nM30\n%\n",
}


@pytest.mark.parametrize(("dialect", "inches"), [("rs274", 0.01), ("fanuc", 0.04)])
def test_in_inches_a_peck_backs_off_by_whole_hundredths(dialect, inches):
    """0.254 mm of LinuxCNC, and 1 mm of Fanuc, which is 0.0394 inches."""
    path = read_program(HOLES[dialect], name="x", dialect=dialect).path
    up = np.flatnonzero((path.kind == RAPID) & (path.end[:, 2] > path.start[:, 2]))[1]  # the first one clears the part
    assert path.end[up, 2] - path.start[up, 2] == pytest.approx(25.4 * inches, abs=1e-9)
