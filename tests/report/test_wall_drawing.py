"""Walls that the bent tool leaves: by how much they are off against the springs of the machine, and how it is drawn."""

import json
import re

import numpy as np
import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.report.wall_drawing import cut_walls
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of
from camcomp.model.job import Job
from camcomp.terminal.cli import run

MACHINE = shipped("config/cartesian.yaml")
STOCK = (
    "workpiece:\n  stock: {type: box, min_mm: [-20, -15, -10], max_mm: [20, 15, 0]}\n"
    "tool: {diameter_mm: 10, teeth: 2, type: flat}\n"
)
SLOT = "G21 G90 G17\nS8000 M3\nG0 X-30 Y2 Z5\nG0 Z-2\nG1 X30 F600\nG0 Z5\nM5\nM2\n"
PUSH = 215.0 / 2e4 * 1e3  # um to the right of the feed, of the force and the spring in config/cartesian.yaml


@pytest.fixture
def files(tmp_path):
    (tmp_path / "stock.yaml").write_text(STOCK)
    (tmp_path / "slot.nc").write_text(SLOT)
    return tmp_path


def test_both_walls_of_a_slot_are_off_by_what_the_springs_give_way(files):
    """The tool is pushed to -y: on that side too much is gone, on the other material is left; corrected, neither."""
    job = Job(load_config([MACHINE, files / "stock.yaml"]))
    program = program_of(SLOT.encode(), "slot.nc", job.config)
    done = compensate(program, job, method="newton", tolerance_um=1.0, version="1")
    corrected = program_of(done.written.data, "out.nc", job.config)
    found = cut_walls(job, program, [("original", program), ("corrected", corrected)])
    assert len(found.walls) == 2 and {wall.level for wall in found.walls} == {-1.0}
    for k, wall in enumerate(found.walls):
        side = np.sign(wall.points[0, 1] - 2.0)
        np.testing.assert_allclose(wall.points[:, 1], 2.0 + 5.0 * side, atol=1e-5)
        np.testing.assert_allclose(wall.inward, np.tile([0.0, side], (len(wall.points), 1)), atol=1e-3)
        inner = np.abs(wall.points[:, 0]) < 18.0
        np.testing.assert_allclose(found.off[0][k][inner], PUSH * side, atol=0.05)
        np.testing.assert_allclose(found.off[1][k][inner], 0.0, atol=0.2)  # rounded words
    assert found.restless < 0.01


def test_the_report_draws_them_and_says_where_they_are_off_most(files):
    words = ["compensate", files / "slot.nc", "--config", MACHINE, "--config", files / "stock.yaml"]
    assert run([str(each) for each in (*words, "--report", files / "r.html", "--quiet")]) == 0
    page = (files / "r.html").read_text()
    data = re.search(r'id="figures">(.*?)</script>', page, re.DOTALL).group(1)
    figures = {each["name"]: each for each in json.loads(data)}
    above, along = figures["walls-above"], figures["walls-along"]
    assert [each["name"] for each in above["traces"]] == ["as meant", "original program", "corrected program"]
    shift = above["exaggerate"]["shifts"][1]["y"]
    assert np.median([s for s in shift if s is not None]) == pytest.approx(-1e-3 * PUSH, abs=1e-5)
    left = [y for y in along["traces"][0]["y"] if y is not None]
    assert np.median(np.abs(left)) == pytest.approx(PUSH, abs=0.01) and min(left) < -10.0 < 10.0 < max(left)
    assert "original program: rms 10.8" in page.replace("\u00a0", " ")


def test_without_a_stock_there_are_no_walls(files):
    words = ["compensate", files / "slot.nc", "--config", MACHINE, "--report", files / "r.html", "--quiet"]
    assert run([str(each) for each in words]) == 0
    assert "walls-above" not in (files / "r.html").read_text()


def test_simulate_draws_the_walls_of_one_program_and_writes_no_log(files, capsys):
    words = [
        "simulate",
        files / "slot.nc",
        "--config",
        MACHINE,
        "--config",
        files / "stock.yaml",
        "--report",
        files / "w.html",
    ]
    assert run([str(each) for each in words]) == 0
    page = (files / "w.html").read_text()
    assert '"name":"walls-above"' in page and "as written: rms 10.8" in page.replace("\u00a0", " ")
    assert "slot.nc" in page and capsys.readouterr().out == ""
