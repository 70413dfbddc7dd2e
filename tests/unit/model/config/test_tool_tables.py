"""Tool tables of LinuxCNC, FreeCAD and spreadsheets: what is taken, what contradicts, what is refused with its place."""

import json

import pytest

from camcomp.api.machine import load_machine, read_program
from camcomp.ground.errors import ConfigError
from camcomp.model.from_program import job_of_program
from tests.commandline import ROOT
from tests.oracles import rs274

CARTESIAN = ROOT / "config/cartesian.yaml"
TBL = """; first line
T1 P1 Z0.511 D0.125 ;1/8 end mill
T3 P3 D+0.201000 Z+1.273000 ;#7 tap drill

T99999 P123     Z+0.100000 ;big tool number
T0 P0 ;no tool
"""
BITS = {
    "5mm_Endmill": {
        "shape": "endmill.fcstd",
        "parameter": {"Diameter": "5.0000 mm", "CuttingEdgeHeight": "30.0000 mm"},
    },
    "5mm_Drill": {"shape": "drill.fcstd", "parameter": {"Diameter": "5,00 mm", "TipAngle": "119.0000 \u00b0"}},
    "6mm_Ball": {"shape-type": "Ballend", "shape": "own.fcstd", "parameter": {"Diameter": "0.25 in", "Flutes": 2}},
    "6mm_Bull": {
        "shape": "bullnose.fcstd",
        "parameter": {"Diameter": "6.0 mm", "CornerRadius": "1.5 mm"},
        "attribute": {"Flutes": "3"},
    },
    "30degree_Vbit": {"shape": "v-bit.fcstd", "parameter": {"Diameter": "10.0 mm"}},
}


def machine(folder, text, files=()):
    for name, content in dict(files).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content, encoding="utf-8")
    (folder / "more.yaml").write_text(text)
    return load_machine(CARTESIAN, folder / "more.yaml")


def library():
    listed = [{"nr": k + 1, "path": f"{name}.fctb"} for k, name in enumerate(BITS)]
    files = {f"Bit/{name}.fctb": json.dumps({"version": 2, "name": name, **bit}) for name, bit in BITS.items()}
    return {**files, "Library/Default.fctl": json.dumps({"tools": listed, "version": 1}, indent=2)}


def keys(config, number):
    return config.tools[number].model_dump(exclude_none=True)


def refusal(folder, text, files=()):
    with pytest.raises(ConfigError) as caught:
        machine(folder, text, files)
    error = caught.value
    assert error.rule == "CC299" and error.at is not None
    return error


def test_a_table_of_linuxcnc_gives_diameters_and_lengths(tmp_path):
    config = machine(tmp_path, "tools: {file: t.tbl, unit: inch}\ntool: {teeth: 2}\n", {"t.tbl": TBL}).config
    assert keys(config, 1) == {"diameter_mm": 3.175, "teeth": 2}
    assert sorted(config.tools) == [1, 3]  # a length alone is no cutter
    assert config.control.tool_lengths_mm == pytest.approx({1: 12.9794, 3: 32.3342, 99999: 2.54})
    assert config.at("tools", 3, "diameter_mm").file.endswith("t.tbl")
    assert (config.at("tools", 3, "diameter_mm").line, config.at("tools", 3, "diameter_mm").column) == (3, 7)


@pytest.mark.parametrize(("flat", "corner"), [("1.0 mm", 1.5), ("0.05 in", 1.23)])
def test_older_bull_noses_state_the_radius_of_their_flat_part(tmp_path, flat, corner):
    """FreeCAD 0.20 makes a bottom of 2 mm and corners up to Z 1.5 mm of Diameter 5 mm and FlatRadius 1 mm."""
    bit = json.dumps({"shape": "bullnose.fcstd", "parameter": {"Diameter": "5.0 mm", "FlatRadius": flat}})
    config = machine(tmp_path, "tools: {1: {file: bull.fctb}}\n", {"bull.fctb": bit}).config
    assert keys(config, 1) == {"diameter_mm": 5.0, "type": "bull", "corner_radius_mm": pytest.approx(corner)}


def test_the_name_alone_is_the_file(tmp_path):
    assert machine(tmp_path, "tools: t.tbl\n", {"t.tbl": "T1 D8 Z5"}).config.tools[1].diameter_mm == 8.0


@rs274.needs_rs274
def test_lengths_are_those_of_linuxcnc_itself(tmp_path):
    program = "G21 G90\nT3 M6\nG43\nG0 X0 Y0 Z5\nG43 H1\nG1 Z-1 F600\nG43 H99999\nG1 X10 Z-2\nM2\n"
    job = machine(tmp_path, "tools: {file: t.tbl, unit: inch}\n", {"t.tbl": TBL})
    mine = read_program(program.encode(), job).path
    theirs = rs274.run(program, table=TBL)
    assert not theirs.error
    ends = [each.machine for each in theirs.motions]
    assert mine.end[:, 2] == pytest.approx([z for _, _, z in ends], abs=1e-3)  # the oracle prints 4 decimals of an inch


def test_a_library_of_freecad_gives_form_and_sizes(tmp_path):
    config = machine(tmp_path, "tools: {file: Library/Default.fctl}\n", library()).config
    assert keys(config, 1) == {"type": "flat", "diameter_mm": 5.0, "flute_length_mm": 30.0}
    assert keys(config, 2) == {"type": "drill", "diameter_mm": 5.0, "point_deg": 119.0}
    assert keys(config, 3) == {"type": "ball", "diameter_mm": 6.35, "teeth": 2}
    assert keys(config, 4) == {"type": "bull", "diameter_mm": 6.0, "corner_radius_mm": 1.5, "teeth": 3}
    assert 5 not in config.tools and "T5 (v-bit)" in config.doubts[0].text


def test_one_tool_bit_is_named_at_its_number(tmp_path):
    config = machine(tmp_path, "tools: {7: {file: Bit/6mm_Ball.fctb, teeth: 4}}\n", library()).config
    assert keys(config, 7) == {"type": "ball", "diameter_mm": 6.35, "teeth": 4}


def test_a_spreadsheet_gives_the_keys_of_its_columns(tmp_path):
    text = "number;name;type;diameter_mm;corner_radius_mm;teeth;length_mm\n1;rough;bull;8,5;1;3;87,4\n4;;ball;6;;2;\n"
    config = machine(tmp_path, "tools: {file: t.csv}\n", {"t.csv": text}).config
    assert keys(config, 1) == {"type": "bull", "diameter_mm": 8.5, "corner_radius_mm": 1.0, "teeth": 3}
    assert keys(config, 4) == {"type": "ball", "diameter_mm": 6.0, "teeth": 2}
    assert config.control.tool_lengths_mm == {1: 87.4}


def test_the_machine_file_counts_and_a_contradiction_is_said_with_both_values(tmp_path):
    text = "tools: {file: t.tbl, 2: {diameter_mm: 5, type: ball}}\ncontrol: {tool_lengths_mm: {1: 80}}\n"
    job = machine(tmp_path, text, {"t.tbl": "T1 D8 Z87.4\nT2 D6 Z60\n"})
    assert keys(job.config, 2) == {"diameter_mm": 5, "type": "ball"}
    assert job.config.control.tool_lengths_mm == {1: 80.0, 2: 60.0}
    program = b"(T1  D=10. CR=0. - ZMIN=-5. - flat end mill)\nT1 M6\nG0 X0 Y0 Z0\nG1 X1 F100\nM30\n"
    tool, length, comment = job_of_program(job, program, "p.nc").taken.remarks
    assert "t.tbl:2: T2 diameter_mm 6 contradicts tools: 2: diameter_mm 5, which counts" in tool
    assert "t.tbl:1: T1 length 87.4 mm contradicts control: tool_lengths_mm: 1: 80, which counts" in length
    assert "flat 10 mm" in comment and "tools: 1: flat 8 mm, which counts" in comment


def test_a_form_of_the_machine_file_takes_the_place_of_all_of_the_tables_form(tmp_path):
    config = machine(tmp_path, "tools: {file: Library/Default.fctl, 4: {type: flat}}\n", library()).config
    assert keys(config, 4) == {"type": "flat", "diameter_mm": 6.0, "teeth": 3}


@pytest.mark.parametrize(
    ("line", "column", "words"),
    [
        ("T1 P1 Dx Z3", 7, "'Dx' is no word"),
        ("P1 D8", 1, "no tool number"),
        ("T1.5 D8", 1, "no tool number"),
        ("T1 D8 D9", 7, "twice"),
        ("POC FMS LEN DIAM COMMENT", 1, "2.3 or older"),
        ("T2 D5", 1, "T2 is there twice (first in line 1)"),
    ],
)
def test_a_line_that_cannot_be_read_is_told_with_its_place(tmp_path, line, column, words):
    error = refusal(tmp_path, "tools: {file: t.tbl}\n", {"t.tbl": f"T2 D6\n{line}\n"})
    assert (error.at.line, error.at.column) == (2, column) and error.at.file.endswith("t.tbl")
    assert words in error.message


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("t.csv", "number,diametr_mm\n1,5\n", "unknown column 'diametr_mm'"),
        ("t.csv", "diameter_mm,teeth\n5,2\n", "no column 'number'"),
        ("t.csv", "number,diameter_mm\n,5\n", "no T number"),
        ("t.csv", "number,diameter_mm\n1,x\n2,3\n", "'x' in column diameter_mm is not a number"),
        ("t.fctl", "{", "no JSON"),
        ("t.fctl", '{"version": 1}', "no list of tools"),
        ("t.fctl", '{"tools": [{"path": "a.fctb"}]}', "no number 'nr'"),
        ("t.fctl", '{"tools": [{"nr": 1, "path": "../passwd"}]}', "names no tool bit"),
        ("t.fctl", '{"tools": [{"nr": 1, "path": "a.fctb"}]}', "'a.fctb' cannot be read"),
        ("t.fctb", json.dumps(BITS["5mm_Drill"]), "states no T number"),
        ("t.xlsx", "", "is no tool table"),
    ],
)
def test_other_tables_are_told_with_their_place(tmp_path, name, text, words):
    assert words in refusal(tmp_path, f"tools: {{file: {name}}}\n", {name: text}).message


def test_a_unit_is_asked_of_files_that_state_none(tmp_path):
    assert (
        "states its units" in refusal(tmp_path, "tools: {file: t.csv, unit: inch}\n", {"t.csv": "number\n1\n"}).message
    )
    assert "without a file" in refusal(tmp_path, "tools: {unit: inch}\n").message
    assert "no unit" in refusal(tmp_path, "tools: {file: t.tbl, unit: cm}\n", {"t.tbl": "T1"}).message


def test_a_size_that_no_tool_has_is_told_where_it_stands(tmp_path):
    with pytest.raises(ConfigError) as caught:
        machine(tmp_path, "tools: {file: t.tbl}\n", {"t.tbl": "T2 D6\nT3 D-4\n"})
    assert (caught.value.rule, caught.value.at.line, caught.value.at.column) == ("CC205", 2, 4)


def test_a_file_that_is_not_there_is_told_where_it_is_named(tmp_path):
    from camcomp.ground.errors import FileError

    with pytest.raises(FileError) as caught:
        machine(tmp_path, "workpiece: {}\ntools: {file: t.tbl}\n")
    assert (caught.value.at.line, caught.value.at.column) == (2, 15)
