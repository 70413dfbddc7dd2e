"""Arms from URDF files: the chain against products of the file's own transforms, and refusals with their lines."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from camcomp.ground.errors import ConfigError
from camcomp.model.config.load import load_config
from camcomp.model.config.urdf import machine_yaml, read_urdf, rotation_vector_deg
from camcomp.model.statics.arm import arm_of, end_pose
from camcomp.model.statics.build import build_robot
from camcomp.model.statics.description import Weight
from tests.commandline import camcomp

# name, type, xyz m, rpy rad, axis
JOINTS = [
    ("pan", "revolute", (0.0, 0.0, 0.4), (0.0, 0.0, 0.1), (0, 0, 1)),
    ("lift", "revolute", (0.3, 0.0, 0.2), (-1.5707963, 0.2, 0.0), (0, 0, -1)),
    ("elbow", "continuous", (1.0, 0.0, 0.0), (0.0, 0.0, -1.5707963), (0, 0, 1)),
    ("twist", "revolute", (0.1, -0.5, 0.0), (1.5707963, 0.0, 0.3), (0, 0, 1)),
    ("rail", "prismatic", (0.0, 0.0, 0.5), (0.0, 0.4, 0.0), (0.6, 0.0, 0.8)),
    ("roll-6", "revolute", (0.0, 0.1, 0.0), (0.2, 0.0, 0.0), (0, 1, 0)),
    ("flange", "fixed", (0.0, 0.0, 0.2), (0.0, 0.3, 0.0), None),
]


def urdf(joints=JOINTS, extra=""):
    lines = ['<?xml version="1.0"?>', '<robot name="test: arm">', '<link name="base"/>']
    last = "base"
    for i, (name, kind, xyz, rpy, axis) in enumerate(joints):
        link = f"l{i}"
        mass = (
            f'<inertial><origin xyz="0.1 0.2 {0.1 * i}"/><mass value="{i + 1}"/></inertial>' if kind != "fixed" else ""
        )
        lines.append(f'<link name="{link}">{mass}</link>')
        limit = '<limit lower="-2" upper="1.5"/>' if kind != "fixed" else ""
        hand = f'<axis xyz="{axis[0]} {axis[1]} {axis[2]}"/>' if axis else ""
        lines.append(
            f'<joint name="{name}" type="{kind}"><parent link="{last}"/><child link="{link}"/>'
            f'<origin xyz="{xyz[0]} {xyz[1]} {xyz[2]}" rpy="{rpy[0]} {rpy[1]} {rpy[2]}"/>{hand}{limit}</joint>'
        )
        last = link
    return "\n".join([*lines, extra, "</robot>"]).encode()


def robot(tmp_path, text):
    file = tmp_path / "machine.yaml"
    file.write_text(machine_yaml(read_urdf(text, "arm.urdf"), "arm.urdf"))
    config = load_config([file])
    return build_robot(config.robot, [0.0, 0.0, 0.0])[0]


def test_poses_are_products_of_the_file_s_transforms(tmp_path):
    arm = arm_of(robot(tmp_path, urdf()))
    for q in np.random.default_rng(4).uniform(-2, 2, (6, 6)) * [1, 1, 1, 1, 200, 1]:
        R, p, k = np.eye(3), np.zeros(3), 0
        for _, kind, xyz, rpy, axis in JOINTS:
            p = p + R @ (1e3 * np.array(xyz))
            R = R @ Rotation.from_euler("xyz", rpy).as_matrix()
            if kind == "prismatic":
                p = p + R @ (np.array(axis) * q[k])
            elif kind != "fixed":
                R = R @ Rotation.from_rotvec(np.array(axis) * q[k]).as_matrix()
            k += kind != "fixed"
        mine = end_pose(arm, q)
        np.testing.assert_allclose(mine[1], p, atol=1e-5)
        np.testing.assert_allclose(mine[0], R @ np.diag([1.0, -1.0, -1.0]), atol=1e-7)


def test_masses_centres_and_limits(tmp_path):
    built = robot(tmp_path, urdf())
    weights = [e for e in built.chains[0].elements if isinstance(e, Weight)]
    np.testing.assert_allclose([w.force[2] for w in weights], -9.80665 * np.arange(1, 7))
    np.testing.assert_allclose(weights[3].centre, [100.0, 200.0, 300.0])
    limits = {a.name: a.limits for a in built.actuators}
    np.testing.assert_allclose(limits["lift"], [-2.0, 1.5], atol=1e-9)
    np.testing.assert_allclose(limits["rail"], [-2000.0, 1500.0])
    assert limits["elbow"] == (-np.inf, np.inf)
    assert "roll_6" in limits


@pytest.mark.parametrize("rpy", [(0.1, -0.2, 0.3), (3.1415, 0.0, 0.0), (0.0, 0.0, 3.14159265358979), (2.9, -1.5, 2.8)])
def test_rotation_vectors(rpy):
    want = Rotation.from_euler("xyz", rpy).as_matrix()
    mine = Rotation.from_rotvec(rotation_vector_deg(np.array(rpy)), degrees=True).as_matrix()
    np.testing.assert_allclose(mine, want, atol=1e-12)


@pytest.mark.parametrize(
    "text, line, says",
    [
        (b"<robot>\n<link name='a'/>\n<link>\n</robot>", 4, "not XML"),
        (b"<machine/>", 1, "not <robot>"),
        (b"<robot name='r'>\n<link name='a'/>\n</robot>", 1, "no joint"),
        (urdf().replace(b'type="continuous"', b'type="floating"'), 9, "is floating"),
        (urdf().replace(b'xyz="0.3 0.0 0.2"', b'xyz="0.3 0.2"'), 7, "not three numbers"),
        (urdf().replace(b'<parent link="l1"/>', b'<parent link="lost"/>'), 9, "not there"),
        (urdf(extra="<xacro:macro/>"), 18, "xacro"),
        (urdf().replace(b'<limit lower="-2" upper="1.5"/></joint>', b'<mimic joint="pan"/></joint>', 1), 5, "follows"),
    ],
)
def test_what_cannot_be_used_is_refused_on_its_line(text, line, says):
    with pytest.raises(ConfigError, match=says) as caught:
        read_urdf(text, "arm.urdf")
    assert caught.value.rule == "CC240"
    assert caught.value.at.line == line


def test_several_ends_have_to_be_chosen_from():
    two = urdf(extra='<link name="cam"/><joint name="c" type="fixed"><parent link="l5"/><child link="cam"/></joint>')
    with pytest.raises(ConfigError, match="several ends") as caught:
        read_urdf(two, "arm.urdf")
    assert "cam, l6" in caught.value.hint
    assert "'cam'" in read_urdf(two, "arm.urdf", "cam").notes[0]


def test_init_writes_a_machine_that_compensates_once_its_springs_are_filled_in(tmp_path):
    file = tmp_path / "arm.urdf"
    slides = [("x", "prismatic", (0, 0, 0.5), (0, 0, 0), (1, 0, 0)), ("y", "prismatic", (0, 0, 0), (0, 0, 0), (0, 1, 0)),
              ("z", "prismatic", (0, 0, 0), (0, 0, 0), (0, 0, 1))]  # fmt: skip
    file.write_bytes(urdf(slides))
    done = camcomp("init", tmp_path / "job", "--from-urdf", file)
    assert done.returncode == 0, done.stderr.decode()
    assert b"chain to link 'l2': x, y, z" in done.stderr
    machine = tmp_path / "job" / "machine.yaml"
    text = machine.read_text()
    assert text.count("#   stiffness_N_per_mm") == 3  # asked for
    text = text.replace("[1000, 0, 0]", "[0, 0, 0]").replace("start_mm: 0", "stiffness_N_per_mm: 1.0e+4, start_mm: 0")
    text = text.replace("  - {type: transform, rotation_deg: [180, 0, 0]}", "")  # these slides end upright
    machine.write_text(text)
    done = camcomp("compensate", tmp_path / "job" / "groove.nc", "--config", machine, "-o", tmp_path / "out.nc")
    assert done.returncode == 0, done.stderr.decode()
    assert b"tip error before: rms 2" in done.stderr  # 215 N on 10 N/um


def test_init_writes_no_machine_of_five_joints(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_bytes(urdf().replace(b'type="prismatic"', b'type="fixed"', 1))
    done = camcomp("init", tmp_path / "job", "--from-urdf", file)
    assert done.returncode == 2 and b"CC240" in done.stderr and b"5 joints move" in done.stderr
    assert not (tmp_path / "job").exists()


GRIPPER = """<link name="knuckle"/><link name="finger"/>
<joint name="grip" type="revolute"><parent link="l6"/><child link="knuckle"/><axis xyz="0 0 1"/>
<mimic joint="motor" multiplier="1" offset="0.25"/></joint>
<joint name="tip" type="fixed"><parent link="knuckle"/><child link="finger"/><origin xyz="0.1 0 0"/></joint>"""


def test_a_joint_that_follows_one_outside_the_chain_stands_at_its_offset():
    arm = read_urdf(urdf(extra=GRIPPER), "arm.urdf")
    assert arm.moving == ("pan", "lift", "elbow", "twist", "rail", "roll_6")
    turned = next(line for line in arm.lines if f"rotation_deg: [0, 0, {np.degrees(0.25):.9g}]" in line)
    assert "transform" in turned
    assert any("'grip' follows another one" in note for note in arm.notes)


def test_the_chain_begins_at_the_base_that_is_named(tmp_path):
    """The rail of joint pan is ignored: the arm behind it stands on link l0."""
    seven = [("x", "prismatic", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1, 0, 0)), *JOINTS]
    whole = read_urdf(urdf(seven), "arm.urdf")
    arm = read_urdf(urdf(seven), "arm.urdf", base="l0")
    assert whole.moving == ("x", *arm.moving) and len(arm.moving) == 6
    with pytest.raises(ConfigError, match="there is no link 'floor'"):
        read_urdf(urdf(seven), "arm.urdf", base="floor")
    with pytest.raises(ConfigError, match="passes the link 'l7'"):
        read_urdf(urdf(seven), "arm.urdf", base="l7")
    (tmp_path / "arm.urdf").write_bytes(urdf(seven))
    done = camcomp("init", tmp_path / "project", "--from-urdf", tmp_path / "arm.urdf", "--base", "l0")
    assert done.returncode == 0, done.stderr


def test_seven_joints_are_valid_for_logs_without_programs(tmp_path):
    """`diagnose` studies the poses of such an arm, so `validate` takes its files."""
    seven = [("x", "prismatic", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1, 0, 0)), *JOINTS]
    (tmp_path / "machine.yaml").write_text(machine_yaml(read_urdf(urdf(seven), "arm.urdf"), "arm.urdf"))
    names = ("x", "pan", "lift", "elbow", "twist", "rail", "roll_6")
    head = ",".join(f"{kind}_{n}_{'mm' if n in ('x', 'rail') else 'rad'}" for n in names for kind in ("cmd", "act"))
    rows = "\n".join(f"{t},{','.join(['0.1'] * 14)}" for t in range(60))
    (tmp_path / "a.csv").write_text(f"t_s,{head}\n{rows}\n")
    (tmp_path / "e.yaml").write_text("config: [machine.yaml]\nruns:\n- {name: a, log: a.csv, cutting: false}\n")
    for file in ("machine.yaml", "e.yaml"):
        done = camcomp("validate", tmp_path / file)
        assert done.returncode == 0, done.stderr
    assert b"7 actuators" in camcomp("validate", tmp_path / "machine.yaml").stderr
    assert camcomp("diagnose", tmp_path / "e.yaml").returncode == 0


def test_the_offset_of_a_table_hints_at_theta(tmp_path):
    (tmp_path / "m.yaml").write_text(
        "robot:\n  name: a\n  type: serial\n  joints:\n    - {name: J1, a_mm: 1, offset_deg: 90}\n"
    )
    done = camcomp("validate", tmp_path / "m.yaml")
    assert done.returncode == 2 and b"did you mean 'theta_deg'?" in done.stderr
