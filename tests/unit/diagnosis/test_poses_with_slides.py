"""Static poses of a SCARA and of a milling machine, each by closed formulas: errors of their slides and joints are found."""

import numpy as np
from scipy.spatial.transform import Rotation

from camcomp.diagnosis.arm.poses import Poses, approached
from camcomp.diagnosis.model.noise import StatedDeviation
from camcomp.ground import shelf
from camcomp.model.config.load import load_config
from camcomp.model.effect import Cause
from camcomp.model.statics.build import build_robot
from tests.studies import arm_study

SCARA = """robot:
  name: scara
  type: serial
  convention: dh
  joints:
    - {name: J1, d_mm: 200, a_mm: 350, start_deg: 20}
    - {name: J2, a_mm: 250, start_deg: 40}
    - {name: Z, joint: prismatic, start_mm: -50}
    - {name: J4, a_mm: 40}
tool: {length_mm: 0}
workpiece: {origin_mm: [500, 200, 100]}
"""
COUNT = 120  # poses of a run


def scara(q):
    """Tips (n, 3) at joints (n, 4)."""
    turns = np.cumsum(q[:, [0, 1, 3]], axis=1)
    return np.column_stack([np.cos(turns) @ [350, 250, 40], np.sin(turns) @ [350, 250, 40], 200 + q[:, 2]])


def mill(q):
    """Tips (n, 3) at slides (n, 3)."""
    return q


def came(x):
    """Way (n,) by which a drive came to positions (n,) from those before."""
    return np.sign(np.diff(x, prepend=x[0]))


def answer(config, kinematics, ranges, error, sd, known=()):
    """The result of two runs in one frame; error: q (n, m) -> what the drives stand off (n, m) and the tips (n, 3)."""
    runs = []
    for seed, name in enumerate("ab"):
        rng = np.random.default_rng(seed)
        q, time = rng.uniform(*ranges, (COUNT, len(ranges[0]))), np.cumsum(rng.uniform(4.0, 9.0, COUNT))
        off, moved = error(q)
        tip = kinematics(q + off) + moved
        tip = Rotation.from_euler("xyz", [1.0, -2.0, 30.0], degrees=True).apply(tip) + [100.0, 20.0, -30.0]
        tip = tip + sd * rng.standard_normal(tip.shape)
        runs.append(
            Poses(label="A", q=q, tip=tip, time=time, temperature=None, run=np.full(COUNT, name), approach=approached(q, time))
        )  # fmt: skip
    robot = build_robot(load_config([config]).robot, [0.0, 0.0, 0.0])[0]
    return arm_study(robot, known, runs, holdout=["b"], stated=StatedDeviation(tip_mm=sd))


def of_scara(folder, error):
    (folder / "scara.yaml").write_text(SCARA)
    ranges = [-1.5, -2.2, -150, -2.5], [1.5, 2.2, 0, 2.5]
    return answer(folder / "scara.yaml", scara, ranges, lambda q: (error(q), np.zeros((COUNT, 3))), 0.02)


def of_mill(error, known=()):
    return answer("config/cartesian.yaml", mill, ([-200, -150, -120], [200, 150, 0]), error, 0.004, known)


def tip_along(axis, way):
    """No drive off, and tips that move along an axis (n, 3)."""
    return np.zeros((COUNT, 3)), np.outer(way, np.eye(3)[axis])


def the_only(result, key):
    """Effect and target of the only cause, and the interval of its parameter."""
    assert result.verdict == "identified"
    (cause,) = result.known
    return (cause.effect, cause.target), cause.parameters[key].ci95


def test_a_wrong_zero_stands_out_where_hardly_another_joint_has_one(tmp_path):
    """That all joints have wrong zeros, J2's included, is no other cause of it."""
    place, (low, high) = the_only(
        of_scara(tmp_path, lambda q: np.outer(np.full(COUNT, 1e-3), np.eye(4)[1])), "offset_rad"
    )
    assert place == ("joint_offset", "J2") and low < 1e-3 < high < low + 2e-4


def test_play_of_a_slide_shows_by_the_way_it_came(tmp_path):
    place, (low, high) = the_only(
        of_scara(tmp_path, lambda q: np.outer(-0.15 * came(q[:, 2]), np.eye(4)[2])), "width_mm"
    )
    assert place == ("backlash", "Z") and low < 0.3 < high < low + 0.05


def test_a_milling_machine_is_out_of_square():
    place, (low, high) = the_only(of_mill(lambda q: tip_along(0, 2e-4 * q[:, 1])), "angle_mrad")
    assert place == ("squareness", "xy") and low < 0.2 < high < low + 0.1


def test_its_guideway_is_bent():
    place, (low, high) = the_only(of_mill(lambda q: tip_along(1, 1.2e-6 * q[:, 0] ** 2)), "quadratic_um_per_m2")
    assert place == ("axis_error", "EYX") and low < 1200.0 < high < low + 400.0


def test_its_squareness_in_the_machine_file_is_no_gap():
    module = shelf.load("effects", "squareness")
    known = [Cause("squareness", module, "xy", {"angle_mrad": 0.2})]
    assert of_mill(lambda q: tip_along(0, 2e-4 * q[:, 1]), known).verdict == "none"
