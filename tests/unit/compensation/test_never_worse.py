"""A corrected program is never worse than the original, however large the tolerance is; where it is, a check fails."""

import numpy as np
import pytest

from camcomp.api.compensation import compensate
from camcomp.api.machine import load_machine
from camcomp.compensation.program.result import worse_than_before
from tests.commandline import ROOT

CIRCLE = b"G21 G90 G17\nS6000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F300\nG1 X5 F600\nG3 X5 Y0 I-5 J0\nM30\n"
SPRING = np.array([2e4, 2e4, 4e4])  # N/mm of config/cartesian.yaml


def distance_from_the_circle(text):
    """Largest distance (mm) between the tip of the loaded machine and the circle, along the corrected lines of the arc.

    The machine of three springs bends by force over stiffness; the force on the tool is 215 N outwards and 10 N back.
    """
    point, worst, on = np.array([0.0, 0.0]), 0.0, False
    for line in text.splitlines():
        words = {each[0]: float(each[1:]) for each in line.split() if each[0] in "XY"}
        if not words or line.startswith(("(", "G0")):
            continue
        end = np.array([words.get("X", point[0]), words.get("Y", point[1])])
        on = on or np.hypot(*point) > 4.9
        if on and np.linalg.norm(end - point) > 0.05:
            way = point + np.linspace(0.0, 1.0, 40)[:, None] * (end - point)
            radial = way / np.hypot(*way.T)[:, None]
            along = np.stack([-radial[:, 1], radial[:, 0]], axis=1)
            tip = way + (215.0 * radial - 10.0 * along) / SPRING[0]
            worst = max(worst, float(np.abs(np.hypot(*tip.T) - 5.0).max()))
        point = end
    return worst


@pytest.mark.parametrize("tolerance_um", [1000.0, 30.0, 5.0])
def test_chords_leave_no_more_than_the_original(tolerance_um):
    done = compensate(CIRCLE, load_machine(ROOT / "config/cartesian.yaml"), tolerance_um=tolerance_um, arcs=False)
    uncorrected = 215.0 / SPRING[0]
    assert distance_from_the_circle(done.text) <= min(1e-3 * tolerance_um, 1.001 * uncorrected)
    assert done.summary.after.max_um <= done.summary.before.max_um
    assert not done.failed


def test_the_check_fails_beyond_rounding_and_one_percent():
    assert worse_than_before(10.0, 10.09, 1e-4) == []
    assert [rule for rule, _ in worse_than_before(10.0, 10.2, 1e-4)] == ["CC609"]
    assert worse_than_before(0.0, 0.17, 1e-4) == []  # rounding to 0.1 um in three axes
    assert [rule for rule, _ in worse_than_before(0.0, 0.18, 1e-4)] == ["CC609"]
