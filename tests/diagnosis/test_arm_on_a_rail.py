"""Static poses of an arm that a slide carries along: the errors of the slide, against a plant of its own."""

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from camcomp.diagnosis.arm.poses import ArmBench, Poses, approached
from camcomp.diagnosis.arm.study import studied
from camcomp.diagnosis.model.noise import StatedDeviation
from camcomp.model.config.load import load_config
from camcomp.model.statics.build import build_robot
from tests.validation.poses.arm import ROOT, Off, load_arm
from tests.validation.poses.plant import poses

SD, TRAVEL, ROWS = 0.02, 2000.0, 80  # mm, mm, poses of a run
ONLY = ("joint_curve", "disturbance", "link_geometry")  # effects that these tests do without, for their time


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    """UR10 on a slide along x, by a file of a user."""
    own = yaml.safe_load((ROOT / "config" / "ur10.yaml").read_text())
    own["robot"]["base"] = {"rotation_deg": [0, 90, 0]}
    slide = {"name": "rail", "joint": "prismatic", "theta_deg": 90, "alpha_deg": -90, "limits_mm": [0, TRAVEL]}
    own["robot"]["joints"][0]["theta_deg"] = -90
    own["robot"]["joints"].insert(0, slide)
    path = tmp_path_factory.mktemp("rail") / "rail.yaml"
    path.write_text(yaml.safe_dump(own))
    return build_robot(load_config([path]).robot, [0.0, 0.0, 0.0])[0]


def run(name, seed, carried):
    """Poses all along the slide; carried: way (mm) and turn (rad) of the slide at its encoder (n,) mm, each (n, 3)."""
    arm, rng = load_arm("ur10"), np.random.default_rng(seed)
    q, time = poses(arm, "joints", ROWS, rng), np.cumsum(rng.uniform(20.0, 60.0, ROWS))
    at = rng.uniform(0.0, TRAVEL, ROWS)
    stand = arm.stand(q, Off.nothing())
    way, turn = carried(at)
    tip = way + Rotation.from_rotvec(turn).apply(stand.point + stand.turn @ [20.0, 40.0, -90.0])
    tip = tip + SD * rng.standard_normal((ROWS, 3))
    every = np.column_stack([at, q])
    way = approached(every, time)
    return Poses(label="A", q=every, tip=tip, time=time, temperature=None, run=np.full(ROWS, name), approach=way)


def answer(robot, carried):
    runs = [run(name, seed, carried) for seed, name in enumerate("ab")]
    return studied(robot, (), runs, without=ONLY, stated=StatedDeviation(SD))[0]


def test_its_pitch_is_found(robot):
    result = answer(robot, lambda at: (np.outer(at * (1.0 + 120e-6), [1, 0, 0]), np.zeros((ROWS, 3))))
    assert [(c.effect, c.target) for c in result.causes] == [("screw_pitch", "rail")]
    low, high = result.causes[0].parameters["error_ppm"].ci95
    assert low < 120.0 < high and high - low < 40.0


def test_play_of_its_rack_is_found(robot):
    def behind(at):
        return np.outer(at - 0.15 * np.sign(np.diff(at, prepend=at[0])), [1, 0, 0]), np.zeros((ROWS, 3))

    result = answer(robot, behind)
    assert [(c.effect, c.target) for c in result.causes] == [("backlash", "rail")]
    low, high = result.causes[0].parameters["width_mm"].ci95
    assert low < 0.3 < high and high - low < 0.06


def test_a_slide_that_rolls_is_unknown_and_depends_on_where_it_stands(robot):
    def rolling(at):
        return np.outer(at, [1, 0, 0]), np.outer(0.3e-3 * np.sin(10.0 * at / TRAVEL), [1, 0, 0])

    result = answer(robot, rolling)
    first = result.where.drivers[0]
    assert (result.verdict, first.covariate) == ("unknown", "position:rail") and first.share > 0.8


def test_it_warms_up_as_a_joint_does(robot):
    still = run("a", 1, lambda at: (np.outer(at, [1, 0, 0]), np.zeros((ROWS, 3))))
    columns = ArmBench(robot=robot, causes=(), campaigns=[still]).columns(ONLY)
    grown = [
        {each.shape for each in columns if (each.effect, each.target) == ("thermal_growth", name)}
        for name in ("rail", "elbow")
    ]
    assert grown[0] == grown[1]
    assert {shape[0][0] for shape in grown[0]} == {"warm_up_s"}
