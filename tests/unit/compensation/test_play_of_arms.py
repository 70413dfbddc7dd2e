"""Play in a joint of an arm is made up for where the joint turns round, or reported as residual: on a plant with a play of its own."""

import numpy as np
import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.totals import Totals
from camcomp.model.config.load import load_config
from camcomp.model.control import open_program
from camcomp.model.job import Job
from tests.validation.recorded.faults import Faults
from tests.validation.recorded.machines import MACHINES

ARM = MACHINES["kuka-kr210"]
# A1 turns round on the arc, at its largest Y, and A2 at its smallest X; A5 on lines
ARC = "G3 X-28 Y2 I-20 J-8 F1000\n"
LINES = "G1 X40 Y10 F1500\nY40\nX-20 Y25 Z-3\nX20 Y-15 Z0\n"


def corrected(tmp_path, joint, width_rad, moves):
    (tmp_path / "in.nc").write_text(f"G21 G90 G17 G94\nG0 X12 Y18 Z0\n{moves}M2\n")
    effect = f"{{effect: joint_hysteresis, target: {joint}, width_rad: {width_rad}}}"
    (tmp_path / "more.yaml").write_text(f"effects: [{effect}]\nprocess: {{force: {{model: none}}}}\n")
    config = load_config(["config/kuka-kr210.yaml", tmp_path / "more.yaml"])
    job = Job(config)
    program = open_program(str(tmp_path / "in.nc"), config)
    return compensate(program, job, method="newton", tolerance_um=1.0, version="0"), job


def play(x, width):
    """Where a body stands that is carried by x (n,) with this much room, in the middle at first."""
    out, at = np.empty_like(x), x[0]
    for i, here in enumerate(x):
        at = max(min(at, here + width / 2), here - width / 2)
        out[i] = at
    return out


def missed(result, job, joint, width_rad):
    """Distances (n,) mm of the plant's tips from the programmed lines and arcs, and of the middles of all written lines."""
    ends = np.concatenate((np.zeros((1, 3)), result.written.end))
    row, f = np.repeat(np.arange(len(ends) - 1), 2), np.tile([[0.5], [1.0]], (len(ends) - 1, 1))
    told = job.frame.to_machine(ends[row] + f * (ends[row + 1] - ends[row]))
    joints, k = ARM.inverse(told), ARM.actuators.index(joint)
    joints[:, k] = play(joints[:, k], width_rad)
    tip = job.frame.to_program(ARM.settle(Faults(), joints, np.zeros_like(told))[0])
    path, rows = result.program.path, result.rows
    motion = rows.motion[row]
    a, b = path.start[motion], path.end[motion]
    along = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
    off = tip - a - np.sum((tip - a) * along, axis=1)[:, None] * along
    distance = np.linalg.norm(off, axis=1)
    arc = path.kind[motion] == 2
    radial = tip[arc] - path.centre[motion[arc]]
    distance[arc] = np.hypot(np.hypot(radial[:, 0], radial[:, 1]) - np.hypot(20.0, 8.0), radial[:, 2])
    return distance[(path.kind[motion] > 0) & ~rows.joining[row]]


@pytest.mark.parametrize(
    ("joint", "moves"), [("A1", ARC), ("A2", ARC), ("A5", LINES)], ids=["A1 arc", "A2 arc", "A5 lines"]
)
def test_a_joint_is_led_through_its_play(tmp_path, joint, moves):
    width = 3e-4
    result, job = corrected(tmp_path, joint, width, moves)
    assert Totals.of(result, job).failed_checks(1.0) == []
    assert np.linalg.norm(result.before, axis=1).max() > 0.05
    assert missed(result, job, joint, width).max() < 1.2e-3


def test_a_joint_that_the_others_cannot_lead_the_tip_past_is_told(tmp_path):
    """While A3 stands the other joints would turn it on, not round: no words X, Y, Z take it through its play."""
    result, job = corrected(tmp_path, "A3", 3e-4, LINES)
    [(rule, text)] = Totals.of(result, job).failed_checks(1.0)
    assert rule == "CC601" and "um are left" in text
    assert np.median(np.linalg.norm(result.after, axis=1)) < 1e-3
