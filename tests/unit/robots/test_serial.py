"""Tables of arms against the textbook's matrices, independent of the plug-in's quaternions."""

from pathlib import Path

import numpy as np
import pytest

from camcomp.ground.errors import ConfigError
from camcomp.model.config.load import load_config
from camcomp.model.statics.arm import arm_of, end_pose
from camcomp.model.statics.build import build_robot
from camcomp.robots.serial import Params, _turned, chains

TABLE = [(350.0, -90.0, 449.4, 10.0), (1150.0, 0.0, -20.0, -90.0), (41.0, 37.0, 5.0, 180.0), (0.0, 90.0, -1200.0, 3.0)]


def z_turn(t, d):
    c, s = np.cos(t), np.sin(t)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, d], [0, 0, 0, 1.0]])


def x_turn(t, a):
    c, s = np.cos(t), np.sin(t)
    return np.array([[1, 0, 0, a], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])


def arm(convention, joints):
    given = Params.model_validate({"convention": convention, "joints": joints})
    from camcomp.model.config.robot import RobotSpec

    robot, nominal = build_robot(RobotSpec.model_validate({"name": "arm", "chains": chains(given)}), [0.0, 0.0, 0.0])
    return arm_of(nominal), robot


@pytest.mark.parametrize("convention", ["dh", "modified"])
def test_pose_is_the_product_of_the_table_s_matrices(convention):
    joints = [
        {"name": f"J{i}", "a_mm": a, "alpha_deg": al, "d_mm": d, "theta_deg": th, "reversed": i == 2}
        for i, (a, al, d, th) in enumerate(TABLE)
    ]
    joints[3]["joint"] = "prismatic"
    mine, _ = arm(convention, joints)
    for q in np.random.default_rng(1).uniform(-3, 3, (5, 4)):
        q = q * [1, 1, 1, 100]
        want = np.eye(4)
        for i, (a, al, d, th) in enumerate(TABLE):
            turn, slide = (q[i] * (-1 if i == 2 else 1), 0.0) if i < 3 else (0.0, q[i])
            joint, link = z_turn(np.radians(th) + turn, d + slide), x_turn(np.radians(al), a)
            want = want @ (joint @ link if convention == "dh" else link @ joint)
        R, p = end_pose(mine, q)
        np.testing.assert_allclose(p, want[:3, 3], atol=1e-9)
        np.testing.assert_allclose(R, want[:3, :3], atol=1e-12)


def test_half_turns_lose_no_digits():
    assert _turned(("z", 180.0)) == [0.0, 0.0, 180.0]
    np.testing.assert_allclose(_turned(("z", 180.0), ("x", 180.0)), [0.0, 180.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(_turned(("z", 90.0), ("x", 90.0)), np.full(3, 120 / np.sqrt(3)), atol=1e-12)


def test_weights_pull_by_mass_at_their_centres():
    _, robot = arm("dh", [{"name": "J", "mass_kg": 10.0, "centre_mm": [1.0, 2.0, 3.0]}])
    weight = robot.chains[0].elements[-1]
    np.testing.assert_allclose(weight.force, [0.0, 0.0, -98.0665])
    np.testing.assert_allclose(weight.centre, [1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    "change, says",
    [
        ("d_mm: 449.4, limits_mm: [0, 1]", "limits_mm does not go with a revolute joint"),
        ("d_mm: 449.4, stiffness_N_per_mm: 1.0", "stiffness_N_per_mm does not go with a revolute joint"),
        ("d_mm: 449.4, thta_deg: 1", "theta_deg"),
    ],
)
def test_mistakes_in_the_table_are_found_where_they_stand(tmp_path, change, says):
    text = Path("config/kuka-kr210.yaml").read_text().replace("d_mm: 449.4", change)
    file = tmp_path / "arm.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load_config([file])
    assert says in f"{caught.value} {caught.value.hint}"
    row = text.splitlines().index(next(each for each in text.splitlines() if "d_mm: 449.4" in each)) + 1
    assert abs(caught.value.at.line - row) <= 1


def test_centre_without_mass_is_refused():
    with pytest.raises(ValueError, match="needs mass_kg"):
        Params.model_validate({"convention": "dh", "joints": [{"name": "J", "centre_mm": [0.0, 0.0, 1.0]}]})
