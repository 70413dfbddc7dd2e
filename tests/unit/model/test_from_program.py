"""Where the stock comes from, what contradicts the machine file, and the line that says which force is assumed."""

import json

import pytest

from camcomp.api.compensation import compensate
from camcomp.api.machine import load_machine
from camcomp.ground.errors import ProgramError
from camcomp.model.from_program import job_of_program
from tests.commandline import ROOT, camcomp

CARTESIAN = ROOT / "config/cartesian.yaml"
STOCK = "(WORKPIECE,BOX,XMIN=-40,YMIN=-40,ZMIN=-10,XMAX=40,YMAX=40,ZMAX=0)\n"
TOOL = "(T1  D=8. CR=0. - ZMIN=-5. - flat end mill)\n"
CUTS = "G21 G90\nT1 M6\nS8000 M3\nG0 X-60 Y0 Z5\nZ-1\nG1 X60 F600\nY4\nX-60\nG0 Z5\nM30\n"


def machine(tmp_path, text=""):
    more = tmp_path / "more.yaml"
    more.write_text(text or "workpiece: {}\n")
    return load_machine(CARTESIAN, more)


def cutting_rows(result):
    force = result.joints.array("fx_N", "fy_N", "fz_N")
    return int((abs(force).sum(axis=1) > 0).sum()), len(force)


def test_stock_of_the_comments_takes_the_force_out_of_the_air(tmp_path):
    plain = compensate(CUTS.encode(), machine(tmp_path))
    found = compensate((STOCK + TOOL + CUTS).encode(), machine(tmp_path))
    joints = found.joints
    cut = joints.array("fx_N", "fy_N", "fz_N").any(axis=1)
    assert abs(joints.array("x_mm")[cut]).max() <= 44.0 + 1e-9  # the block and the radius of the tool
    assert abs(plain.joints.array("x_mm")[plain.joints.array("fx_N", "fy_N", "fz_N").any(axis=1)]).max() == 60.0
    assert found.summary.force.engagement == "stock" and plain.summary.force.engagement == "none"
    assert [each.split(":")[0] for each in found.summary.stated_in_program] == ["line 1", "line 2"]


def test_none_ignores_stocks_of_comments_and_machine_file(tmp_path):
    own = machine(
        tmp_path, "workpiece: {stock: {type: box, min_mm: [0,0,-1], max_mm: [1,1,0]}}\ntool: {diameter_mm: 8}\n"
    )
    result = compensate((STOCK + TOOL + CUTS).encode(), own, stock="none")
    assert result.summary.force.engagement == "none" and "no stock" in result.summary.force.text


def test_a_contradiction_is_said_with_both_values_and_the_machine_file_counts(tmp_path):
    own = machine(
        tmp_path,
        "workpiece: {stock: {type: box, min_mm: [-40,-40,-10], max_mm: [40,40,1]}}\ntool: {diameter_mm: 6}\n",
    )
    job = job_of_program(own, (STOCK + TOOL + CUTS).encode(), "p.nc")
    assert job.config == own.config
    tool, stock = job.taken.remarks
    assert "flat 8 mm" in tool and "flat 6 mm, which counts" in tool
    assert "to [40, 40, 0]" in stock and "to [40, 40, 1] mm, which counts" in stock


def test_what_agrees_is_not_said(tmp_path):
    own = machine(
        tmp_path,
        "workpiece: {stock: {type: box, min_mm: [-40,-40,-10], max_mm: [40,40,0]}}\ntool: {diameter_mm: 8}\n",
    )
    assert job_of_program(own, (STOCK + TOOL + CUTS).encode(), "p.nc") is own


def remarks(tmp_path, yaml, comments):
    return job_of_program(machine(tmp_path, yaml), (comments + CUTS).encode(), "p.nc").taken.remarks


BALL = TOOL.replace("CR=0.", "CR=4.").replace("flat", "ball")


@pytest.mark.parametrize(
    ("yaml", "comments", "both"),
    [
        ("", TOOL + TOOL.replace("8.", "6."), ("flat 8 mm", "flat 6 mm", "neither is taken")),
        ("tools: {1: {diameter_mm: 8, type: ball}}\n", TOOL, ("flat 8 mm", "tools: 1: ball 8 mm, which counts")),
        ("tool: {diameter_mm: 10, type: bull, corner_radius_mm: 1}\n",
         TOOL.replace("D=8. CR=0.", "D=10. CR=2.").replace("flat", "bull nose"), ("corner radius 2 mm", "tool: bull 10 mm, corner radius 1 mm")),
        ("", "(@FC|MATERIAL|name=Steel)\n(MATERIAL - ALUMINUM MM - 2024)\n", ("Steel", "ALUMINUM")),
        ("", "(Units: inch)\n", ("the comment says inch", "unit code says mm, which counts")),
        ("", STOCK + STOCK.replace("40", "41"), ("[40, 40, 0]", "[41, 41, 0]")),
    ],
)  # fmt: skip
def test_contradictions_are_said_with_both_values(tmp_path, yaml, comments, both):
    (said,) = remarks(tmp_path, yaml, comments)
    assert all(each in said for each in both), said


@pytest.mark.parametrize(
    ("yaml", "keys"),
    [
        ("tool: {diameter_mm: 8, teeth: 3}\n", {"diameter_mm": 8, "teeth": 3, "type": "ball"}),
        ("tools: {1: {teeth: 4}}\n", {"diameter_mm": 8, "teeth": 4, "type": "ball"}),
    ],
)
def test_comments_add_the_keys_that_the_machine_file_leaves_open(tmp_path, yaml, keys):
    job = job_of_program(machine(tmp_path, yaml), (BALL + CUTS).encode(), "p.nc")
    assert job.config.tools[1].model_dump(exclude_none=True) == keys and not job.taken.remarks
    assert job.taken.said == ("line 1: T1 ball 8 mm (Fusion (@F360|..., T1 D=...))",)


def test_a_broken_tool_is_a_remark_and_the_next_one_is_taken(tmp_path):
    for choice in (None, "program", "comments"):
        text = STOCK + TOOL.replace("8.", "8,5") + TOOL.replace("T1", "T2") + CUTS
        job = job_of_program(machine(tmp_path), text.encode(), "p.nc", choice)
        assert set(job.taken.tools) == {2} and [each[:34] for each in job.taken.remarks] == [
            "not taken from the program: line 2:"[:34]
        ]


def test_a_great_many_doubts_are_counted(tmp_path):
    said = remarks(tmp_path, "", "".join(f"(T{k} D=x CR=0. - ZMIN=-5. - flat end mill)\n" for k in range(500)))
    assert len(said) == 21 and said[-1].startswith("480 more")


INCHES = "(Units: 'in' and 'in/min')\n" + CUTS.replace("G21 ", "")


def test_a_unit_that_stands_in_a_comment_only_is_refused(tmp_path):
    for choice in (None, "none", "program"):
        with pytest.raises(ProgramError) as caught:
            job_of_program(machine(tmp_path), INCHES.encode(), "p.nc", choice)
        assert caught.value.rule == "CC147" and caught.value.at.line == 1
    job = job_of_program(machine(tmp_path, "control: {program_unit: inch}\n"), INCHES.encode(), "p.nc")
    assert not job.taken.remarks
    (said,) = remarks(tmp_path, "control: {program_unit: mm}\n", "(Units: inch)\n") or [""]
    assert "which counts" in said


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "no comment states the stock"),
        ("(STOCK/BLOCK,9,9,9)\n", "place of the block"),
        (
            STOCK + STOCK.replace("40", "41"),
            "to [40, 40, 0] mm (LinuxCNC (WORKPIECE,...)) contradicts line 2: stock box [-41,",
        ),
        (STOCK + "G55\n", "work offset, and the program uses G55"),
    ],
)
def test_comments_that_are_asked_for_and_leave_it_open_are_refused_with_their_place(tmp_path, text, why):
    with pytest.raises(ProgramError) as caught:
        job_of_program(machine(tmp_path), (text + CUTS).encode(), "p.nc", "comments")
    assert caught.value.rule == "CC143" and why in caught.value.message and caught.value.at.line >= 1


def test_a_doubt_that_was_not_asked_for_is_a_warning(tmp_path):
    job = job_of_program(machine(tmp_path), (STOCK + "G55\n" + CUTS).encode(), "p.nc")
    assert job.config.workpiece.stock is None
    assert job.taken.remarks and job.taken.remarks[0].startswith("not taken from the program")


def test_a_second_pass_beside_the_first_is_warned_of(tmp_path):
    own = machine(tmp_path, "tool: {diameter_mm: 8}\n")
    warned = compensate(CUTS.encode(), own).summary.warnings
    assert any("% of the feed path" in each for each in warned)
    apart = compensate(CUTS.replace("Y4", "Y9").encode(), own).summary.warnings
    assert not any("% of the feed path" in each for each in apart)


RAPID_CUTS = "G21 G90\nS8000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F300\nG1 X10 F600\nG0 X20\nG1 X30\nG0 Z5\nG0 X0\nM30\n"


@pytest.mark.parametrize(
    ("more", "text", "lines"),
    [
        ("", RAPID_CUTS, "6"),
        ("", RAPID_CUTS.replace("G0 X20", "G0 Z5\nG0 X20\nG0 Z-1"), None),
        ("workpiece: {stock_top_mm: -2}\n", RAPID_CUTS, None),
        ("workpiece: {stock_top_mm: 0}\n", RAPID_CUTS, "6"),
    ],
)
def test_a_rapid_at_cutting_depth_is_warned_of(tmp_path, more, text, lines):
    warned = [each for each in compensate(text.encode(), machine(tmp_path, more)).summary.warnings if "G0" in each]
    assert len(warned) == (lines is not None) and all(f"source line {lines}:" in each for each in warned)


@pytest.mark.parametrize("kind", ["ball", "drill"])
def test_a_tool_that_is_no_flat_mill_is_warned_of(tmp_path, kind):
    own = machine(tmp_path, f"tool: {{diameter_mm: 8, type: {kind}}}\n")
    assert any(f"the tool is a {kind}" in each for each in compensate(CUTS.encode(), own).summary.warnings)


def test_the_corner_of_a_stock_at_zero_has_no_sign(tmp_path):
    text = "(STOCK/BLOCK,100,60,20,0,0,20)\n" + CUTS
    found = compensate(text.encode(), machine(tmp_path, "tool: {diameter_mm: 8}\n")).summary.stated_in_program
    assert any("stock box [0, 0, -20] to [100, 60, 0] mm" in each for each in found)


def test_terminal_summary_and_batch_say_the_force(tmp_path):
    program = tmp_path / "p.nc"
    program.write_text(STOCK + TOOL + CUTS)
    done = camcomp(
        "compensate", program, "--config", CARTESIAN, "-o", tmp_path / "o.nc", "--summary", tmp_path / "s.json"
    )
    said = done.stderr.decode()
    assert done.returncode == 0 and "\nforce: constant model, where and how deep" in said
    assert "read from the program: line 1: stock box [-40, -40, -10] to [40, 40, 0] mm" in said
    figures = json.loads((tmp_path / "s.json").read_text())
    assert set(figures["force"]) == {"model", "engagement", "text"}
    done = camcomp("verify", tmp_path / "o.nc", "--against", program, "--config", CARTESIAN)
    assert done.returncode == 0 and "compensated for another machine" not in done.stderr.decode()
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "p.nc").write_bytes(program.read_bytes())
    done = camcomp("batch", folder, "--config", CARTESIAN, "--output-dir", tmp_path / "out", "--jobs", "1")
    assert done.returncode == 0, done.stderr.decode()
    assert (tmp_path / "out/p.nc").read_bytes() == (tmp_path / "o.nc").read_bytes()
