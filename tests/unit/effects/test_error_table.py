"""Error tables of slides: CSV with both directions, LinuxCNC's screw files read and written, the loop closed."""

import numpy as np
import pytest

from camcomp.ground.errors import CamcompError
from camcomp.model.config.load import load_config
from camcomp.model.error_table.table import comp_text, parse_comp, parse_table
from tests.validation import runner
from tests.validation.plants.guideways import PROGRAMS, dense, misses

CSV = "position_mm,forward_um,reverse_um\n-100,20,30\n0,-8,0\n40,2,12\n100,-20,-5\n"
COMP = "0.000000 0.000000 -0.001279\n0.100000 0.098742 0.051632\n0.200000 0.171529 0.194216\n"  # LinuxCNC's own example


def test_between_rows_the_table_is_straight_beyond_them_it_stays_and_each_way_has_its_column():
    table = parse_table(CSV, "x.csv")
    position = np.array([-50.0, 20.0, 20.0, 20.0, 300.0, -300.0])
    assert table.at(position, np.array([1.0, 1, -1, 0, 1, -1])) == pytest.approx(
        [0.006, -0.003, 0.006, 0.0015, -0.02, 0.03]
    )


@pytest.mark.parametrize(("unit", "size"), [("mm", 1.0), ("um", 1e-3), ("rad", 1.0), ("mrad", 1e-3), ("urad", 1e-6)])
def test_one_column_serves_both_ways_in_any_unit(unit, size):
    table = parse_table(f"position_mm,error_{unit}\n0,1\n10,3\n", "x.csv")
    assert table.at(np.array([5.0, 5.0]), np.array([1.0, -1.0])) == pytest.approx([2 * size] * 2)
    assert table.angle == unit.endswith("rad")


@pytest.mark.parametrize("comp_type", [0, 1])
def test_a_screw_file_is_read_as_linuxcnc_reads_it(comp_type):
    """Type 0 states the position of the axis, type 1 the addition to the command: it goes the other way."""
    table = parse_comp(COMP, "x.comp", comp_type)
    want = [0.098742 - 0.1, 0.051632 - 0.1] if comp_type == 0 else [-0.098742, -0.051632]
    assert table.at(np.array([0.1, 0.1]), np.array([1.0, -1.0])) == pytest.approx(want)
    again = parse_comp(comp_text(table, 1 - comp_type), "y.comp", 1 - comp_type)
    assert np.allclose([again.forward, again.reverse], [table.forward, table.reverse], atol=1.1e-6)


@pytest.mark.parametrize(
    ("text", "said", "line"),
    [
        ("position_mm,error_um\n0,1\n0,2\n", "does not rise", 3),
        ("position_mm,error_um\n0,1\n5,\n", "empty", 3),
        ("position_mm,error_um\n0,x\n5,1\n", "not a number", 2),
        ("position_mm,error\n0,1\n5,1\n", "no column holds the error", 1),
        ("place_mm,error_um\n0,1\n5,1\n", "no column says where", 1),
        ("position_mm,error_um\n0,1\n", "two rows", 1),
    ],
)  # fmt: skip
def test_what_is_no_table_is_refused_at_its_place(tmp_path, text, said, line):
    (tmp_path / "x.csv").write_text(text)
    (tmp_path / "m.yaml").write_text("effects: [{effect: error_table, target: x, file: x.csv}]\n")
    with pytest.raises(CamcompError) as error:
        load_config(["config/cartesian.yaml", tmp_path / "m.yaml"])
    assert (error.value.rule, error.value.at.line) == ("CC266", line) and said in str(error.value)


@pytest.mark.parametrize(
    ("effect", "rule", "said"),
    [
        ("{effect: error_table, target: A1, positions_mm: [0, 1], forward_um: [0, 1]}", "CC205", "hinge"),
        ("{effect: error_table, target: A1, comp_type: 0}", "CC215", "no file"),
    ],
)  # fmt: skip
def test_a_table_is_of_slides(tmp_path, effect, rule, said):
    (tmp_path / "m.yaml").write_text(f"effects: [{effect}]\n")
    with pytest.raises(CamcompError) as error:
        load_config(["config/kuka-kr210.yaml", tmp_path / "m.yaml"])
    assert error.value.rule == rule and said in str(error.value)


def test_a_screw_file_that_ends_in_words_is_refused():
    with pytest.raises(CamcompError) as error:
        parse_comp("0 0 0\n1 1 1\n# end\n", "x.comp", 0)
    assert error.value.at.line == 3


def driven(program):
    """Tips (n, 3) of a machine whose carriage x hangs between the two columns of the CSV above, typed in once more."""
    tip = dense(program)
    x = tip[:, 0]
    there = np.interp(x, [-100, 0, 40, 100], [0.020, -0.008, 0.002, -0.020])
    back = np.interp(x, [-100, 0, 40, 100], [0.030, 0.0, 0.012, -0.005])
    now = 1e9 if x[0] < 0 else -1e9  # from which side the rapid came
    for i in range(len(x)):
        now = min(max(now, x[i] + there[i]), x[i] + back[i])
        tip[i, 0] = now
    return tip


@pytest.mark.parametrize("form", ["csv", "comp"])
@pytest.mark.parametrize("program", ["left", "ramps"])
def test_a_machine_with_that_screw_follows_the_corrected_program(tmp_path, form, program):
    if form == "csv":
        (tmp_path / "x.csv").write_text(CSV)
        effect = "{effect: error_table, target: x, file: x.csv}"
    else:
        (tmp_path / "x.comp").write_text(comp_text(parse_table(CSV, "x.csv"), 0))
        effect = "{effect: error_table, target: x, file: x.comp, comp_type: 0}"
    more, source, out = tmp_path / "more.yaml", tmp_path / "in.nc", tmp_path / "out.nc"
    more.write_text(f"effects: [{effect}]\nprocess: {{force: {{model: none}}}}\n")
    source.write_text(PROGRAMS[program])
    code, said = runner.invoke(
        ["compensate", str(source), "--config", "config/cartesian.yaml", "--config", str(more), "-o", str(out)]
    )
    assert code == 0, said
    assert misses(driven(source.read_text()), PROGRAMS[program]) > 0.008
    assert misses(driven(out.read_text()), PROGRAMS[program]) < 0.0012


def test_the_screw_file_of_a_machine_holds_all_that_its_drive_does(tmp_path):
    """Pitch from home (0 here), a constant, and half of the play either way."""
    effects = ["{effect: screw_pitch, target: x, error_ppm: 100}", "{effect: backlash, target: x, width_mm: 0.02}"]
    effects += [
        "{effect: joint_offset, target: x, offset_mm: 0.003}",
        "{effect: screw_pitch, target: y, error_ppm: 900}",
    ]
    more, out = tmp_path / "more.yaml", tmp_path / "x.comp"
    more.write_text(f"effects: [{', '.join(effects)}]\n")
    files = ["--config", "config/cartesian.yaml", "--config", str(more)]
    line = ["config", "screw-file", *files, "--actuator", "x", "--from-mm", "-20", "--to-mm", "50", "--step-mm", "30"]
    code, said = runner.invoke([*line, "-o", str(out)])
    assert code == 0, said
    rows = np.loadtxt(out)
    assert rows[:, 0].tolist() == [-20.0, 10.0, 40.0, 50.0]
    assert rows[:, 1] - rows[:, 0] == pytest.approx(1e-4 * rows[:, 0] + 0.003 - 0.01, abs=1e-6)
    assert rows[:, 2] - rows[:, 0] == pytest.approx(1e-4 * rows[:, 0] + 0.003 + 0.01, abs=1e-6)
    assert runner.invoke([*line[:-2], "--step-mm", "0"])[0] == 2
    assert runner.invoke([*line, "--actuator", "q"])[0] == 2
