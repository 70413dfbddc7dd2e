"""Admissible machine files: one accepted machine, and one mistake at a time in it."""

from math import pi, radians

import pytest

from camcomp.ground.errors import CamcompError, ConfigError
from camcomp.model.config.links import Beam, Rectangle, Round, Square, Tube
from camcomp.model.config.load import load_config
from tests.commandline import ROOT

MACHINE = """\
robot:
  name: test
  chains:
    x:
      elements:
        - {type: actuator, joint: prismatic, axis: x, stiffness_N_per_mm: 1e4, limits_mm: [-1, 1], home_mm: -1}
        - {type: passive, joint: revolute, axis: [0, 3, 4], start_deg: 90}
        - {type: link, LINK}
    a:
      frame: yzx
      base_error: {rotation_deg: [1, 0, 0]}
      elements:
        - {type: transform, translation_mm: [1, 2, 3]}
        - {type: actuator, joint: revolute, axis: -z, name: turn, stiffness_Nmm_per_rad: 1e6, home_deg: 180}
        - {type: parallelogram, arm_mm: [1, 0, 0], hinge: y, crossbar: z, width_mm: 80, bar: {LINK}}
        - {type: weight, force_N: 3}
"""
BEAM = "beam: {length_mm: 100, E_N_per_mm2: 70000, nu: 0.3, section: {type: round, diameter_mm: 10}}"
DIAGONAL = "compliance_diagonal: {translation_mm_per_N: [1e-4, 0, 0], rotation_rad_per_Nmm: [0, 0, 0]}"


def load(tmp_path, text):
    file = tmp_path / "machine.yaml"
    file.write_text(text)
    return load_config([file])


def refused(tmp_path, text):
    with pytest.raises(CamcompError) as caught:
        load(tmp_path, text)
    return [each for each in caught.value.all()]


def matrix(**changes):
    rows = [[1.0 if i == j else 0.0 for j in range(6)] for i in range(6)]
    for place, value in changes.items():
        rows[int(place[1]) - 1][int(place[2]) - 1] = value
    return rows


def test_the_machine_is_read(tmp_path):
    robot = load(tmp_path, MACHINE.replace("LINK", BEAM)).robot
    assert list(robot.actuators) == ["x", "turn"]
    x, turn = robot.actuators.values()
    assert (x.rotary, x.stiffness, x.home, x.limits) == (False, 1e4, -1, (-1, 1))
    assert (turn.rotary, turn.stiffness, turn.home, turn.limits) == (True, 1e6, pytest.approx(pi), None)
    assert robot.chains["x"].elements[1].start == pytest.approx(pi / 2)
    assert robot.chains["a"].base_error.rotation_deg == [1, 0, 0]
    assert robot.chains["x"].frame == "xyz"


MISTAKES = {
    "unknown axis": ("axis: x", "axis: w", "CC205", "axis"),
    "zero axis": ("[0, 3, 4]", "[0, 0, 0]", "CC205", "axis"),
    "nan axis": ("[0, 3, 4]", "[0, .nan, 0]", "CC205", "axis"),
    "limits": ("[-1, 1]", "[1, -1]", "CC209", "low < high"),
    "equal limits": ("[-1, 1]", "[1, 1]", "CC209", "low < high"),
    "negative stiffness": ("stiffness_N_per_mm: 1e4", "stiffness_N_per_mm: -1", "CC205", "greater than 0"),
    "nan": ("stiffness_N_per_mm: 1e4", "stiffness_N_per_mm: .nan", "CC206", "finite"),
    "infinity": ("home_mm: -1", "home_mm: -.inf", "CC206", "finite"),
    "text for a number": ("home_mm: -1", "home_mm: '-1'", "CC204", "number"),
    "bool for a number": ("home_mm: -1", "home_mm: true", "CC204", "number"),
    "unit missing": ("home_mm: -1", "home: -1", "CC202", "'home'"),
    "unit of the other joint": ("stiffness_Nmm_per_rad", "stiffness_N_per_mm", "CC201", "'stiffness_N_per_mm'"),
    "typing mistake": ("home_mm: -1", "hoem_mm: -1", "CC201", "'hoem_mm'"),
    "unknown element": ("type: transform", "type: transfrom", "CC205", "'transfrom'"),
    "no type": ("{type: weight, ", "{", "CC203", "'type'"),
    "missing key": ("width_mm: 80, ", "", "CC203", "'width_mm'"),
    "two numbers": ("[1, 2, 3]", "[1, 2]", "CC205", "3 items, not 2"),
    "frame": ("frame: yzx", "frame: xzy", "CC205", "'xzy'"),
    "same name twice": ("name: turn", "name: x", "CC205", "two actuators"),
    "a name that is no column name": ("name: turn", "name: a-b", "CC205", "pattern"),
    "no notation of a link": ("{type: link, LINK}", "{type: link}", "CC215", "exactly one"),
    "two notations of a link": ("{type: link, LINK}", "{type: link, LINK, " + DIAGONAL + "}", "CC215", "2 are given"),
    "nothing in a section": ("robot:", "tool:\nrobot:", "CC204", "not nothing"),
    "unknown section": ("robot:", "robto: 1\nrobot:", "CC201", "'robto'"),
    "unknown method": ("robot:", "compensation: {method: exact}\nrobot:", "CC205", "'exact'"),
    "unknown dialect": ("robot:", "control: {dialect: klingon}\nrobot:", "CC213", "'klingon'"),
    "unknown force": ("robot:", "process: {force: {model: dark}}\nrobot:", "CC213", "'dark'"),
    "unknown effect": ("robot:", "effects: [{effect: ghost}]\nrobot:", "CC213", "'ghost'"),
    "force parameter": (
        "robot:", "process: {force: {model: constant, Fr: 1, Ft_N: 1, Fz_N: 1}}\nrobot:", "CC202", "'Fr'"),
    "effect without target": (
        "robot:", "effects: [{effect: backlash, width_mm: 0.1}]\nrobot:", "CC205", "needs a target"),
    "effect with a target of nobody": (
        "robot:", "effects: [{effect: backlash, target: q}]\nrobot:", "CC205", "no actuator 'q'"),
    "effect of the machine with target": (
        "robot:", "effects: [{effect: gravity, target: x}]\nrobot:", "CC205", "as a whole"),
    "effect out of bounds": (
        "robot:", "effects: [{effect: backlash, target: x, width_mm: 9}]\nrobot:", "CC205", "width_mm"),
    "two rotations": (
        "robot:", "workpiece: {rotation_deg: 1, rotation_vector_deg: [0, 0, 1]}\nrobot:", "CC215", "one of"),
    "two tool lengths": ("robot:", "tool: {length_mm: 1, vector_mm: [0, 0, 1]}\nrobot:", "CC215", "one of"),
    "G54 twice": ("robot:", "control: {offsets_mm: {G54: [0, 0, 0]}}\nrobot:", "CC205", "offsets_mm"),
}  # fmt: skip


@pytest.mark.parametrize("case", MISTAKES)
def test_one_mistake_is_one_error_at_its_place(tmp_path, case):
    old, new, rule, words = MISTAKES[case]
    assert old in MACHINE
    text = MACHINE.replace(old, new, 1)
    errors = refused(tmp_path, text.replace("LINK", BEAM))
    assert [each.rule for each in errors] == [rule], [each.message for each in errors]
    error = errors[0]
    assert words in error.message
    lines = text.split("\n")
    changed = [i for i, (a, b) in enumerate(zip(lines, MACHINE.split("\n"), strict=False), 1) if a != b]
    assert error.at.line == changed[0]
    assert error.at.source == lines[error.at.line - 1].replace("LINK", BEAM)


def test_actuators_are_named_apart_and_there_is_one(tmp_path):
    slide = "{type: actuator, joint: prismatic, axis: x}"
    text = "robot:\n  name: a\n  chains:\n    x: {elements: [%s]}"
    assert "two actuators of chain 'x'" in refused(tmp_path, text % f"{slide}, {slide}")[0].message
    assert "no chain has an actuator" in refused(tmp_path, text % "{type: transform}")[0].message


def test_every_missing_key_of_a_mapping_is_told(tmp_path):
    errors = refused(tmp_path, MACHINE.replace("LINK", "beam: {nu: 0.3, section: {type: round, diameter_mm: 1}}"))
    keys = [each.message.rsplit(" ", 1)[1] for each in errors if each.at.line == 8]
    assert keys == ["'length_mm'", "'E_N_per_mm2'"]


def test_a_unit_is_missed_even_where_the_key_looks_otherwise_unlike(tmp_path):
    errors = refused(tmp_path, MACHINE.replace("LINK", BEAM.replace("E_N_per_mm2", "E")))
    assert [each.rule for each in errors] == ["CC202", "CC202"]


def test_keys_that_are_numbers_have_places_too(tmp_path):
    error = refused(tmp_path, MACHINE.replace("LINK", BEAM) + "control:\n  tool_lengths_mm:\n    1: 5\n    2: x\n")[0]
    assert (error.rule, error.at.source) == ("CC204", "    2: x")


def test_hints_say_what_was_meant(tmp_path):
    text = MACHINE.replace("LINK", BEAM)
    assert "write home_mm" in refused(tmp_path, text.replace("home_mm", "home"))[0].hint
    assert "did you mean 'home_mm'" in refused(tmp_path, text.replace("home_mm", "hoem_mm"))[0].hint
    assert "did you mean 'transform'" in refused(tmp_path, text.replace("transform", "transfrom"))[0].hint


@pytest.mark.parametrize(
    ("kind", "rows", "words"),
    [
        ("compliance", matrix()[:5], "6 rows"),
        ("compliance", [row[:5] for row in matrix()], "6 rows"),
        ("compliance", matrix(e12=0.5), "not symmetric: element (1, 2)"),
        ("compliance", matrix(e12=2.0, e21=2.0), "not positive definite"),
        ("compliance", matrix(e12=1.0, e21=1.0), "not positive definite"),
        ("compliance", matrix(e33=-1.0), "element 3 of the diagonal"),
        ("compliance", matrix(e33=0.0, e34=0.1, e43=0.1), "element 3 of the diagonal"),
        ("stiffness", matrix(e33=0.0), "row 3 is zero"),
        ("stiffness", matrix(e26=3.0, e62=3.0), "not positive definite"),
    ],
)
def test_matrices_refused(tmp_path, kind, rows, words):
    errors = refused(tmp_path, MACHINE.replace("LINK", f"{kind}_mm_N_rad: {rows}"))
    assert [each.rule for each in errors] == ["CC208", "CC208"]  # the link and the bar
    assert words in errors[0].message
    assert errors[0].at.line == 8


@pytest.mark.parametrize("rows", [matrix(), matrix(e33=0.0), matrix(e22=1e-2, e66=4e-7, e26=5e-5, e62=5e-5)])
def test_compliance_accepted(tmp_path, rows):
    config = load(tmp_path, MACHINE.replace("LINK", f"compliance_mm_N_rad: {rows}"))
    assert config.robot.chains["x"].elements[2].compliance == rows


def test_nan_in_a_matrix_is_told_at_its_number(tmp_path):
    rows = str(matrix(e13=7.25)).replace("7.25", ".nan")
    error = refused(tmp_path, MACHINE.replace("LINK", f"stiffness_mm_N_rad: {rows}"))[0]
    assert error.rule == "CC206"
    assert error.at.source[error.at.column - 1 :].startswith(".nan")


def test_sections():
    assert Square(type="square", side_mm=15).moments() == pytest.approx((225, 4218.75, 4218.75, 7138.125))
    area, iy, iz, j = Rectangle(type="rectangle", width_mm=12, height_mm=24).moments()
    assert (area, iy, iz) == pytest.approx((288, 13824, 3456))
    assert j == pytest.approx(0.2287 * 24 * 12**3, rel=2e-3)  # table value for a / b = 2
    solid = Round(type="round", diameter_mm=10).moments()
    assert solid[3] == pytest.approx(2 * solid[1])
    assert solid[0] == pytest.approx(25 * pi)
    tube = Tube(type="tube", outer_diameter_mm=10, inner_diameter_mm=6).moments()
    hole = Round(type="round", diameter_mm=6).moments()
    assert tube == pytest.approx([a - b for a, b in zip(solid, hole, strict=True)])


def test_shear_modulus():
    section = Square(type="square", side_mm=15)
    assert Beam(length_mm=1, E_N_per_mm2=70000, nu=0.33, section=section).shear_modulus == pytest.approx(26316, abs=0.5)
    assert Beam(length_mm=1, E_N_per_mm2=70000, G_N_per_mm2=25000, section=section).shear_modulus == 25000


def test_tool_and_workpiece(tmp_path):
    def section(text):
        return load(tmp_path, MACHINE.replace("LINK", BEAM) + text)

    assert section("tool: {length_mm: 100}").tool.tip == [0, 0, -100]
    assert section("tool: {vector_mm: [1, 2, 3]}").tool.tip == [-1, -2, -3]
    assert section("").tool.tip == [0, 0, 0]
    assert section("workpiece: {rotation_deg: 30}").workpiece.rotation == [0, 0, 30]
    assert section("workpiece: {rotation_vector_deg: [1, 2, 3]}").workpiece.rotation == [1, 2, 3]


def test_plug_in_parameters_are_completed(tmp_path):
    text = "effects: [{effect: screw_cyclic, target: x, amplitude_mm: 0.01}]\nprocess: {force: {model: constant, Fr_N: 1, Ft_N: 2, Fz_N: 3}}"
    config = load(tmp_path, MACHINE.replace("LINK", BEAM) + text)
    assert config.effects[0].given == {"amplitude_mm": 0.01}
    assert set(config.effects[0].values) == {"amplitude_mm", "pitch_mm", "phase_rad"}
    assert config.process.force.params.Fr_N == 1
    assert radians(180) == pytest.approx(config.robot.actuators["turn"].home)


@pytest.mark.parametrize(("machine", "first", "second"), [("router", "x", "y"), ("kuka-kr210", "A1", "A2")])
def test_a_name_that_is_there_twice_is_told_at_the_second(tmp_path, machine, first, second):
    """In chains as in rows of a robot plug-in."""
    text = (ROOT / f"config/{machine}.yaml").read_text()
    number, line = next((i, line) for i, line in enumerate(text.splitlines(), 1) if f"name: {second}," in line)
    (error,) = refused(tmp_path, text.replace(f"name: {second},", f"name: {first},"))
    assert (error.rule, error.at.line) == ("CC205", number)
    assert error.at.column == line.index(f"name: {second},") + len("name: ") + 1


def test_a_table_that_is_missing_is_told_where_it_is_named(tmp_path):
    text = (
        ROOT / "config/cartesian.yaml"
    ).read_text() + "\neffects:\n  - {effect: error_table, target: x, file: no.csv}\n"
    (error,) = refused(tmp_path, text)
    assert error.rule == "CC500" and error.at.source[error.at.column - 1 :].startswith("no.csv")


def test_numbers_of_tools_may_be_written_as_json_has_them(tmp_path):
    machine = ROOT / "config/cartesian.yaml"
    override = tmp_path / "tools.json.yaml"
    override.write_text(
        '{"tools": {"1": {"diameter_mm": 10}, "12": {"diameter_mm": 6}}, "control": {"tool_lengths_mm": {"1": 80}}}'
    )
    config = load_config([machine, override])
    assert {number: tool.diameter_mm for number, tool in config.tools.items()} == {1: 10, 12: 6}
    assert config.control.tool_lengths_mm == {1: 80}
    override.write_text('tools: {1: {diameter_mm: 10}, "1": {diameter_mm: 6}}\n')
    with pytest.raises(ConfigError) as caught:
        load_config([machine, override])
    assert caught.value.rule == "CC207"
