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
    assert [each.split(":")[0] for each in found.summary.stated_in_program] == ["line 2", "line 1"]


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


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "no comment states the stock"),
        ("(STOCK/BLOCK,9,9,9)\n", "place of the block"),
        (STOCK + STOCK.replace("40", "41"), "another comment states another stock"),
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
    assert len(warned) == (lines is not None) and all(f"source lines {lines}:" in each for each in warned)


@pytest.mark.parametrize("kind", ["ball", "drill"])
def test_a_tool_that_is_no_flat_mill_is_warned_of(tmp_path, kind):
    own = machine(tmp_path, f"tool: {{diameter_mm: 8, type: {kind}}}\n")
    assert any(f"the tool is a {kind}" in each for each in compensate(CUTS.encode(), own).summary.warnings)


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
