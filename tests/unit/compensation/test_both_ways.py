"""Programs corrected in pieces and as a whole: the same warnings in the same order, figures and exit code."""

import json

import numpy as np
import pytest

from camcomp.ground.native_code import describe
from camcomp.terminal.cli import run
from tests.commandline import ROOT

CONFIG = ROOT / "config/cartesian.yaml"
HEAD = "G21 G90\nT1 M6\nS8000 M3\nG0 X0 Y0 Z5\nG1 Z-1 F600\n"
RASTER = HEAD + "".join(f"G1 X{0 if k % 2 else 40}\nG1 Y{4 * k + 4}\n" for k in range(40)) + "G0 Z5\nM30\n"
ARCS = (ROOT / "samples/groove-circle-50.nc").read_text()
SHORT = HEAD + "".join(f"G1 X{9 + k % 2} Y{0.1 * k}\n" for k in range(60)) + "G0 Z5\nM30\n"
MILL = "tool: {diameter_mm: 6}\n"
TOOLS = "tools: {1: {diameter_mm: 6, type: ball}, 2: {diameter_mm: 3, type: drill}}\n"
STOCK = "workpiece: {stock: {type: box, min_mm: [-10, -10, -10], max_mm: [20, 20, 0]}, stock_top_mm: 2}\n"
TOO_MUCH = STOCK + "tool: {diameter_mm: 8, flute_length_mm: 0.5}\nprocess: {depth_mm: 3, width_mm: 3}\n"
CASES = {  # name: what is laid over the machine file, program, words of a warning
    "step-over": (MILL, RASTER, "% of the feed path runs less than one tool diameter"),
    "step-over in inches": ("tool: {diameter_mm: 150}\n", RASTER.replace("G21", "G20").replace("F600", "F9"), "less than one"),
    "no step-over": ("tool: {diameter_mm: 3}\n", RASTER, None),
    "tools": (TOOLS, RASTER.replace("M30", "T2 M6\nG1 Z-3 F100\nG0 Z5\nM30"), "the tool is a drill"),
    "G0 at depth": (MILL, RASTER.replace("G1 Y40\n", "G0 Y40\n"), "G0 at cutting depth"),
    "spindle": ("", RASTER.replace("G1 Y40\n", "M5\nG1 Y40\n"), "spindle stopped"),
    "stock": (TOO_MUCH, SHORT, "above the flutes"),
    "comments": ("", "(T1 D=8. CR=4. - ZMIN=-5. - ball end mill)\n(T2 D=x CR=0. - ZMIN=-5. - drill)\n" + RASTER, "not taken"),
    "unknown start": ("", "G91 G1 X1 F100\nG90\n" + RASTER + "G1 X3\n", "starts with a relative move"),
    "machine axes": ("", RASTER.replace("G0 Z5\nM30", "G53 G1 X1 Y1 F100\nM151\nM30"), "machine coordinates"),
    "rounding": ("control: {path_mode: G64 P0.05}\n", ARCS, "ends of cuts and joining lines"),
    "small corrections": ("process: {force: {model: none}}\n", RASTER, "below the step"),
}  # fmt: skip


SLOW = "step-over in inches"  # walks over metres


@pytest.mark.parametrize("name", [pytest.param(k, marks=pytest.mark.campaign) if k == SLOW else k for k in CASES])
def test_warnings_figures_and_exit_code(tmp_path, monkeypatch, name):
    more, text, words = CASES[name]
    over, program = tmp_path / "over.yaml", tmp_path / "p.nc"
    over.write_text(more or "control: {}\n")
    program.write_text(text)
    codes, found = [], []
    for long in (0, 1 << 40):
        monkeypatch.setattr("camcomp.compensation.file_to_file.LONG", long)
        summary = tmp_path / f"{long}.json"
        codes.append(
            run([*map(str, ("compensate", program, "--config", CONFIG, "--config", over, "--summary", summary, "-q"))])
        )
        found.append(json.loads(summary.read_text()))
    pieces, whole = found
    assert "interpolation" in pieces and codes[0] == codes[1]
    assert pieces["warnings"] == whole["warnings"]
    assert not words or any(words in each for each in whole["warnings"])
    assert [key for key in pieces if key != "interpolation"] == list(whole)
    assert {key: pieces[key] for key in ("force", "segments_in", "lines_in", "control_mode", "joining_lines")} == {
        key: whole[key] for key in ("force", "segments_in", "lines_in", "control_mode", "joining_lines")
    }


def test_two_programs_in_one_file_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("camcomp.compensation.file_to_file.LONG", 0)
    program = ROOT / "tests/golden/bad/fanuc-two-programs.nc"
    assert run(["compensate", str(program), "--config", str(CONFIG), "-o", str(tmp_path / "o.nc"), "-q"]) == 3


def test_a_program_whose_interpolation_is_not_good_enough_is_solved_point_by_point(tmp_path, monkeypatch):
    monkeypatch.setattr("camcomp.compensation.file_to_file.LONG", 0)
    monkeypatch.setattr("camcomp.compensation.program.result.BOUND_UM", 0.0)
    program, summary = tmp_path / "p.nc", tmp_path / "s.json"
    program.write_text(RASTER)
    words = ("compensate", program, "--config", CONFIG, "--summary", summary, "-q")
    assert run([*map(str, words)]) == 0
    assert "interpolation" not in json.loads(summary.read_text())


def test_the_kernels_of_a_stock_are_kept():
    """Arguments that cannot be described are compiled for in every process."""
    assert describe((np.zeros(3, np.float32),)) == (("<f4", 1, "C", True),)
