"""Files that were never meant for camcomp, values far from every machine, and text that would be more than text."""

import pytest

from camcomp.ground.errors import ConfigError, format_error
from camcomp.ground.files import shipped
from camcomp.model.config.load import check_config, load_config, load_experiment
from camcomp.model.config.urdf import MOST_PARTS, machine_yaml, read_urdf
from camcomp.terminal.cli import run
from tests.unit.model.config.test_urdf import JOINTS, urdf

SECRETS = (
    b"root:$6$hush:19000:0:99999:7:::\ndaemon:*:19000:0:99999:7:::\n",
    b"-----BEGIN PRIVATE KEY-----\nhush\n-----END PRIVATE KEY-----\n",
    b"PASSWORD=hush\nB: {\n",
    b'{"password": "hush"}',
    b"password: hush\nhush: &a [*a]\n",
    b"- hush\n",
    b"hush",
    b"\xff\xfehush",
    b"\thush: 1\n",
    b"hush: 1e999\nhush: !!python/name:hush.hush\n",
)


@pytest.mark.parametrize("content", SECRETS)
def test_nothing_of_a_file_that_is_no_config_is_shown(tmp_path, content):
    file = tmp_path / "other"
    file.write_bytes(content)
    machine = shipped("config/cartesian.yaml")
    for work in (
        lambda: load_config([file]), lambda: load_config([machine, file]), lambda: check_config([file]),
        lambda: load_experiment(file),
    ):  # fmt: skip
        with pytest.raises(ConfigError) as caught:
            work()
        said = format_error(caught.value)
        assert "CC218" in said and "hush" not in said and "19000" not in said and "PRIVATE" not in said
        assert caught.value.at.file == str(file)


def test_a_section_with_a_typing_mistake_is_still_a_config(tmp_path):
    for text, rule in (("proces: {depth_mm: 1}\n", "CC201"), ("robot: {\n", "CC200"), ('{"tool": [}', "CC200")):
        (tmp_path / "over.yaml").write_text(text)
        with pytest.raises(ConfigError) as caught:
            check_config([tmp_path / "over.yaml"])
        assert caught.value.rule == rule


@pytest.mark.parametrize("kind", ["[serial]", "{a: 1}", "null", "1"])
def test_the_type_of_a_robot_is_a_name(tmp_path, kind):
    (tmp_path / "machine.yaml").write_text(f"robot: {{type: {kind}, name: x}}\n")
    for work in (load_config, check_config):
        with pytest.raises(ConfigError) as caught:
            work([tmp_path / "machine.yaml"])
        assert caught.value.rule == "CC204" and caught.value.at.column == 15


@pytest.mark.parametrize(
    ("config", "old", "new"),
    [
        ("cartesian", "resolution_mm: 0.0001", "resolution_mm: 1.0e-18"),
        ("cartesian", "tolerance_um: 1.0", "tolerance_um: 1.0e-18"),
        ("orthoglide", "arm_mm: [310.583, 0, 0]", "arm_mm: [0, 0, 0]"),
        ("orthoglide", "rotation_rad_per_Nmm: [1.0e-7", "rotation_rad_per_Nmm: [1.0e-300"),
    ],
)
def test_values_beside_every_machine_are_refused(tmp_path, config, old, new):
    text = shipped(f"config/{config}.yaml").read_text()
    assert old in text
    (tmp_path / "machine.yaml").write_text(text.replace(old, new))
    with pytest.raises(ConfigError) as caught:
        load_config([tmp_path / "machine.yaml"])
    assert caught.value.rule == "CC205" and caught.value.at.line > 1


def test_a_log_that_would_fill_the_disk_is_not_begun(tmp_path, capsys):
    slow = tmp_path / "slow.yaml"
    slow.write_text("control: {acceleration_mm_per_s2: 1.0e-18}\n")
    program, machine = (str(shipped(each)) for each in ("samples/groove-circle-2.nc", "config/cartesian.yaml"))
    assert run(["simulate", program, "--config", machine, "--config", str(slow)]) == 2
    said = capsys.readouterr()
    assert "CC425" in said.err and not said.out


# --- URDF -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["a&#10;tool: {length_mm: 7}", "a: b", "- a", "'a' &quot;b&quot; # c", "a&#13;b&#133;c", "&#x1F600;"]
)
def test_names_stay_names(tmp_path, name):
    joints = [(name, *JOINTS[0][1:]), *JOINTS[1:]]
    text = urdf(joints).decode().replace("l0", name).replace("test: arm", name).encode()
    arm = read_urdf(text, "arm.urdf")
    file = tmp_path / "machine.yaml"
    file.write_text(machine_yaml(arm, "a\nb: c.urdf"), encoding="utf-8")
    config = load_config([file])
    assert config.tool.length_mm == 100 and len(config.robot.actuators) == 6
    assert set(config.model_fields_set) == {"robot", "workpiece", "tool", "process", "control", "compensation"}
    assert all(len(each.splitlines()) == 1 for each in (*arm.notes, *arm.lines))


@pytest.mark.parametrize(
    "text",
    [
        b"<?xml version='1.0' encoding='no-such'?><robot/>",
        b"<?xml version='1.0' encoding='utf-16'?><robot/>",
        b"<?xml version='1.0' encoding='hex'?><robot/>",
        b"",
        b"\0",
        b"<robot>" * 20_000,
        b"<robot>" + b"<link/>" * (MOST_PARTS + 1) + b"</robot>",
        b"<!DOCTYPE a [<!ENTITY a 'aaaaaaaaaa'>"
        + b"".join(b"<!ENTITY %c '%s'>" % (98 + i, b"&%c;" % (97 + i) * 10) for i in range(9))
        + b"]><robot name='&j;'/>",
        urdf().replace(b'value="1"', b'value="1e308"'),
        urdf().replace(b'value="1"', b'value="inf"'),
        urdf().replace(b'lower="-2"', b'lower="-1_0"'),
        urdf().replace(b'xyz="0.0 0.0 0.4"', b'xyz="0 0 1e300"'),
    ],
    ids=range(12),
)
def test_what_is_no_arm_is_refused(text):
    with pytest.raises(ConfigError) as caught:
        read_urdf(text, "arm.urdf")
    assert caught.value.rule == "CC240" and caught.value.at.line >= 1 and len(format_error(caught.value)) < 500
