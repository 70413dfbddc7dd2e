"""An arm on a rail: errors of the slide under it are found on static poses."""

from pathlib import Path

import numpy as np
import pytest

from camcomp.diagnosis.arm.poses import Poses, approached
from camcomp.diagnosis.model.noise import StatedDeviation
from camcomp.model.config.load import load_config
from camcomp.model.statics.build import build_robot
from tests.studies import arm_study
from tests.validation.plants.arm_poses import measured

STATED, COUNT = StatedDeviation(tip_mm=0.02), 120
RANGES = [0, -1, -2, -2, -3, -2, -3], [3000, 1, -0.3, 2, 3, 2, 3]  # mm, rad


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    text = Path("config/ur10.yaml").read_text()
    rail = "joints:\n    - {name: E1, joint: prismatic, theta_deg: 90, alpha_deg: -90, limits_mm: [-100, 3100]}\n"
    path = tmp_path_factory.mktemp("rail") / "arm.yaml"
    path.write_text(text.replace("joints:\n", "base: {rotation_deg: [0, 90, 0]}\n  " + rail, 1))
    return build_robot(load_config([path]).robot, [0.0, 0.0, 0.0])[0]


def run(name, seed, carriage):
    """Poses in which the carriage of the rail, along -y of the arm, stands off its encoder (n,) by carriage(encoder)."""
    q = np.random.default_rng(seed).uniform(*RANGES, (COUNT, 7))
    time = np.arange(float(COUNT))
    tip = measured(q[:, 1:], seed, at=np.outer(q[:, 0] + carriage(q[:, 0]), [0.0, -1.0, 0.0]))
    return Poses(label=name, q=q, tip=tip, time=time, temperature=None, run=np.full(COUNT, name), approach=approached(q, time))  # fmt: skip


def named(robot, carriage):
    runs = [run(name, k, carriage) for k, name in enumerate("AB")]
    return arm_study(robot, (), runs, holdout=["B"], stated=STATED).known


def test_lost_motion_of_a_rack_is_found(robot):
    (cause,) = named(robot, lambda x: -0.15 * np.sign(np.diff(x, prepend=x[0])))
    assert (cause.effect, cause.target) == ("joint_hysteresis", "E1")
    low, high = cause.parameters["width_mm"].ci95
    assert low < 0.3 < high < low + 0.05


def test_a_rail_that_is_longer_than_it_counts_is_found(robot):
    (cause,) = named(robot, lambda x: 3e-4 * x)
    assert (cause.effect, cause.target) == ("screw_pitch", "E1")
    low, high = cause.parameters["error_ppm"].ci95
    assert low < 300.0 < high < low + 30.0
