"""LinuxCNC's INI file as a layer of the configuration: what is taken in which unit, and what is not."""

import pytest

from camcomp.api.machine import load_machine
from camcomp.ground.errors import ConfigError
from camcomp.model.control import program_of
from camcomp.model.from_program import job_of_program
from camcomp.terminal.cli import run
from tests.commandline import ROOT

CARTESIAN = ROOT / "config/cartesian.yaml"
INI = """# a mill
[EMCIO]
TOOL_TABLE = tool.tbl

[TRAJ]
LINEAR_UNITS = inch
MAX_LINEAR_VELOCITY = 4

[KINS]
KINEMATICS = trivkins coordinates=XYYZ

[AXIS_X]
MAX_VELOCITY = 3
MAX_ACCELERATION = 30
MIN_LIMIT = -10
MAX_LIMIT = 10.0
[AXIS_Y]
MIN_LIMIT = -5
MAX_LIMIT = 5
[JOINT_1]
MAX_ACCELERATION = 20
MIN_LIMIT = -6
MAX_LIMIT = 4
[JOINT_2]
MIN_LIMIT = -4.5
MAX_LIMIT = 6
[JOINT_3]
MAX_VELOCITY = 5
MIN_LIMIT = -8
;MIN_LIMIT = -1
MAX_LIMIT = 0.12
"""


def machine(folder, ini=INI, *files, tools="T1 D0.25 Z2\n"):
    (folder / "mill.ini").write_text(ini)
    (folder / "tool.tbl").write_text(tools)
    return load_machine(*(files or (CARTESIAN,)), folder / "mill.ini")


def test_speed_acceleration_travel_and_tools_are_taken_in_mm(tmp_path):
    config = machine(tmp_path).config
    assert (config.control.velocity_mm_per_s, config.control.acceleration_mm_per_s2) == (76.2, 508.0)
    travel = {name: each.limits_mm for name, each in config.robot.actuators.items()}
    assert travel == {"x": [-254.0, 254.0], "y": [-114.3, 101.6], "z": [-203.2, 3.048]}
    assert config.tools[1].diameter_mm == 6.35 and config.control.tool_lengths_mm == {1: 50.8}
    at = config.at("control", "velocity_mm_per_s")
    assert (at.line, at.column) == (13, 16) and at.file.endswith("mill.ini")


def test_later_files_go_over_the_ini_file(tmp_path):
    (tmp_path / "more.yaml").write_text("control: {velocity_mm_per_s: 10}\ntools: {1: {diameter_mm: 5}}\n")
    (tmp_path / "mill.ini").write_text(INI)
    (tmp_path / "tool.tbl").write_text("T1 D0.25 Z2\n")
    job = load_machine(CARTESIAN, tmp_path / "mill.ini", tmp_path / "more.yaml")
    assert job.config.control.velocity_mm_per_s == 10.0 and job.config.control.acceleration_mm_per_s2 == 508.0
    (remark,) = job_of_program(job, b"G0 X0\n", "p.nc").taken.remarks
    assert "tool.tbl:1: T1 diameter_mm 6.35 contradicts tools: 1: diameter_mm 5" in remark


def test_a_program_beyond_the_travel_is_told(tmp_path, capfd):
    machine(tmp_path)
    (tmp_path / "part.nc").write_text("G21 G90\nG0 X0 Y0 Z0\nG1 Y103 F600\nM2\n")
    arguments = ["compensate", str(tmp_path / "part.nc"), "--config", str(CARTESIAN), "-o", str(tmp_path / "out.nc")]
    assert run(arguments) == 0
    assert run([*arguments, "--config", str(tmp_path / "mill.ini")]) == 1
    assert "CC602" in (said := capfd.readouterr().err) and "-114.3 to 101.6 mm" in said


@pytest.mark.parametrize(
    ("ini", "files", "words"),
    [
        (INI.replace("trivkins coordinates=XYYZ", "lineardeltakins"), (), "joints of lineardeltakins have zeros"),
        (INI, (ROOT / "config/orthoglide.yaml",), "'x' is no slide of a machine of one chain"),
    ],
)
def test_travel_that_may_have_another_zero_is_not_taken(tmp_path, ini, files, words):
    config = machine(tmp_path, ini, *files).config
    assert words in config.doubts[0].text
    before = load_machine(*(files or (CARTESIAN,))).config
    assert [a.limits for a in config.robot.actuators.values()] == [a.limits for a in before.robot.actuators.values()]


@pytest.mark.parametrize(
    ("ini", "rule", "line"),
    [
        (INI.replace("= 3\n", "= fast\n"), "CC204", 13),
        (INI.replace("= inch", "= furlong"), "CC205", 6),
        ("[desktop]\nIcon = x\n", "CC218", 1),
    ],
)
def test_what_cannot_be_read_is_told_with_its_place(tmp_path, ini, rule, line):
    with pytest.raises(ConfigError) as caught:
        machine(tmp_path, ini)
    assert (caught.value.rule, caught.value.at.line) == (rule, line)


@pytest.mark.parametrize(
    ("ini", "own", "unit"),
    [
        (INI, "", 25.4),
        (INI.replace("= inch", "= mm"), "", 1.0),
        (INI + "[RS274NGC]\nRS274NGC_STARTUP_CODE = G17 G21 G90\n", "", 1.0),
        (INI, "control: {program_unit: mm}\n", 1.0),
    ],
)
def test_a_program_without_a_unit_code_is_in_the_unit_of_the_control(tmp_path, ini, own, unit):
    (tmp_path / "mill.ini").write_text(ini)
    (tmp_path / "tool.tbl").write_text("T1 P1 D.25\n")
    (tmp_path / "own.yaml").write_text(own or "workpiece: {}\n")
    config = load_machine(CARTESIAN, tmp_path / "mill.ini", tmp_path / "own.yaml").config
    path = program_of(b"G90 G0 X1 Y2 Z3\nG1 X2 F10\nG21 X5\n", "p.nc", config).path
    assert path.end[:, 0] == pytest.approx([unit, 2 * unit, 5.0]) and path.feed[1] == pytest.approx(10 * unit)
