"""What is left out in turn of static poses: runs of one clamping in the frames that the others fix."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from camcomp.diagnosis.arm.poses import Poses
from camcomp.diagnosis.arm.study import studied
from camcomp.diagnosis.model.noise import StatedDeviation
from camcomp.model.config.load import load_config
from camcomp.model.statics.build import build_robot
from tests.validation.poses.arm import ROOT, Off, load_arm
from tests.validation.poses.plant import poses

SD = 0.02  # mm
ONLY = ("joint_curve", "disturbance", "link_geometry")  # effects that these tests do without, for their time


def run(name, seed, clamping, rows=40, off=None, base=0):
    """Poses in an order with a clock; base: draws where the arm stands and how it is turned, 0 for its place."""
    arm, rng = load_arm("ur10"), np.random.default_rng(seed)
    q, time = poses(arm, "joints", rows, rng), np.cumsum(rng.uniform(20.0, 60.0, rows))
    stand = arm.stand(q, off or Off.nothing())
    tip = stand.point + stand.turn @ [20.0, 40.0, -90.0] + SD * rng.standard_normal((rows, 3))
    if base:
        moved = np.random.default_rng(base)
        tip = Rotation.from_rotvec(moved.normal(0.0, 0.3, 3)).apply(tip) + moved.normal(0.0, 400.0, 3)
    return Poses(label=clamping, q=q, tip=tip, time=time, temperature=None, run=np.full(rows, name))


def answer(runs):
    robot = build_robot(load_config([ROOT / "config" / "ur10.yaml"]).robot, [0.0, 0.0, 0.0])[0]
    return studied(robot, (), runs, without=ONLY, stated=StatedDeviation(SD))[0]


def longer():
    off = Off.nothing()
    off.length[2] = 0.25
    return off


def test_runs_of_one_clamping_are_left_out_in_turn_in_its_frames():
    result = answer([run(name, seed, "A", off=longer()) for seed, name in enumerate("abc")])
    assert result.verdict == "identified"
    assert (result.shrinkage.holdout, result.shrinkage.refitted) == (("a", "b", "c"), ())
    assert result.shrinkage.after_rms_um == pytest.approx(result.floor.um, rel=0.15)
    assert result.shrinkage.ratio > 0.8


def test_a_clamping_of_its_own_has_its_frames_fitted_again():
    result = answer(
        [run(name, seed, clamping, off=longer()) for seed, (name, clamping) in enumerate(("aA", "bA", "cC"))]
    )
    assert result.verdict == "identified" and len(result.shrinkage.refitted) == 2


@pytest.mark.campaign
def test_a_base_that_is_set_anew_for_every_few_poses_has_frames_of_its_own_each_time():
    result = answer([run(f"r{k}", k, f"at {k}", rows=8, off=longer(), base=k + 1) for k in range(6)])
    assert result.verdict == "identified" and [(c.effect, c.target) for c in result.causes] == [
        ("link_length", "elbow")
    ]
    low, high = result.causes[0].parameters["length_mm"].ci95
    assert low < 0.25 < high and high - low < 0.1
    assert result.shrinkage.ratio > 0.7


def test_a_run_that_is_alone_has_no_unseen_poses():
    result = answer([run("a", 1, "A", rows=60, off=longer())])
    assert result.verdict == "ambiguous" and result.shrinkage is None
