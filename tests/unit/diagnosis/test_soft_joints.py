"""Arms whose joints give way under their weight: truth by the plant of poses, which shares no code with camcomp."""

import numpy as np
import pytest

from camcomp.diagnosis.arm.linear import Shelf
from camcomp.diagnosis.arm.poses import ArmBench, Poses
from camcomp.diagnosis.arm.study import relinearised
from camcomp.diagnosis.model.explain import KnownNoise
from camcomp.ground import shelf
from camcomp.model.config.load import load_config
from camcomp.model.effect import Cause
from camcomp.model.statics.build import build_robot
from tests.commandline import ROOT
from tests.validation.poses.arm import Off, load_arm

SD = 0.02  # mm per coordinate


def bench(q, tip):
    n = len(q)
    robot = build_robot(load_config([ROOT / "config/ur10.yaml"]).robot, [0.0, 0.0, 0.0])[0]
    run = Poses(label="A", q=q, tip=tip, time=np.arange(float(n)), temperature=None, run=np.full(n, "A"))
    return ArmBench(robot=robot, causes=(), campaigns=[run])


def test_weight_is_no_cause_on_an_arm_whose_model_has_no_spring():
    rng, soft = np.random.default_rng(5), Off.nothing()
    q = np.array([0.0, -1.2, 0.9, -1.2, -1.5, 0.0]) + rng.uniform(-0.7, 0.7, (80, 6))
    soft.compliance[1], soft.compliance[2] = 6e-9, 1e-8
    stand = load_arm("ur10").stand(q, soft)
    tip = stand.point + stand.turn @ np.array([20.0, -10.0, 60.0]) + SD * rng.standard_normal((80, 3))
    own = bench(q, tip)
    some = Shelf.of([c for c in own.columns() if c.effect in ("gravity", "gravity_compliance", "joint_offset")])
    found = relinearised(own, some, SD, KnownNoise(), [np.ones(80)])
    (weight,) = (j for j, column in enumerate(some.columns) if column.effect == "gravity")
    assert found.model.size[weight] == 0.0
    assert {found.model.candidates[i].place for i in found.members} == {
        ("gravity_compliance", "shoulder_lift"),
        ("gravity_compliance", "elbow"),
    }


@pytest.mark.parametrize("stretched", [0.0, -np.pi])
def test_play_of_a_hinge_lets_the_arm_sink_whichever_side_its_weight_hangs_on(stretched):
    """The tip sinks by half of the width times its distance from the axis."""
    q = np.array([[0.0, stretched, 0.0, -1.5, -1.5, 0.0]])
    own = bench(np.repeat(q, 12, axis=0) + 1e-3 * np.random.default_rng(1).standard_normal((12, 6)), np.ones((12, 3)))
    play = Cause("backlash", shelf.load("effects", "backlash"), "shoulder_lift", {"width_rad": 2e-4})
    before, after = (own.standing(own.campaigns[0], causes).hung.point for causes in ((), (play,)))
    reach = np.hypot(*before[:, :2].T)
    assert (after - before)[:, 2] == pytest.approx(-1e-4 * reach, rel=0.1)
