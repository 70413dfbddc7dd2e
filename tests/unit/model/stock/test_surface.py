"""The surface that a program leaves: heights against the springs of the machine, and a body that is closed."""

import struct

import numpy as np
import pytest

from camcomp.terminal.cli import run
from tests.commandline import ROOT

SLOT = "G21 G90 G17\nS8000 M3\nG0 X-30 Y0 Z5\nG1 Z-2 F300\nG1 X30 F600\nG0 Z5\nM5\nM2\n"
STOCK = (
    "workpiece:\n  stock: {type: box, min_mm: [-20, -15, -10], max_mm: [20, 15, 0]}\n"
    "tool: {diameter_mm: 10, teeth: 2, type: flat}\n"
)


@pytest.fixture
def project(tmp_path):
    (tmp_path / "slot.nc").write_text(SLOT)
    (tmp_path / "stock.yaml").write_text(STOCK)
    return tmp_path


def give(folder, *words):
    configs = ["--config", str(ROOT / "config/cartesian.yaml"), "--config", str(folder / "stock.yaml")]
    return run([str(each) for each in (*words, *configs)])


def heights(folder, program, name="s.csv"):
    """Points (n, 3) mm of the surface that a program leaves."""
    assert give(folder, "simulate", folder / program, "--surface", folder / name) == 0
    return np.loadtxt(folder / name, delimiter=",", skiprows=1)


def test_the_floor_of_a_slot_lies_where_the_springs_let_the_tip_go(project):
    """-25 N on a spring of 4e4 N/mm: 0.625 um deeper than written; what nothing touched keeps its height."""
    x, y, z = heights(project, "slot.nc").T
    floor = (np.abs(y) < 4.5) & (np.abs(x) < 19.5)
    assert z[floor] == pytest.approx(-2.0 - 25.0 / 4.0e4, abs=1e-4)
    untouched = np.abs(y) > 5.5
    assert z[untouched] == pytest.approx(0.0, abs=1e-9) and untouched.any()


def test_walls_lie_where_the_force_pushes_the_tool(project):
    """215 N to the right of the feed on 2e4 N/mm: both walls of the slot lie 10.75 um further to -y."""
    text = (
        (project / "stock.yaml")
        .read_text()
        .replace("max_mm: [20, 15, 0]}", "max_mm: [20, 15, 0], resolution_mm: 0.05}")
    )
    (project / "stock.yaml").write_text(text.replace("-20, -15", "-2, -15").replace("[20, 15", "[2, 15"))
    x, y, z = heights(project, "slot.nc").T
    row = np.abs(x) < 0.01
    cut = y[row][z[row] < -1.0]
    # the column at 5 mm stands, that at -5 mm is cut: a wall between 0 and 50 um below either
    assert cut.max() < 5.0 - 1e-6 and cut.min() == pytest.approx(-5.0, abs=1e-6)


def test_the_compensated_program_leaves_what_was_meant(project):
    assert give(project, "compensate", project / "slot.nc", "-o", project / "out.nc", "--quiet") == 0
    x, y, z = heights(project, "out.nc").T
    floor = (np.abs(y) < 4.5) & (np.abs(x) < 19.5)
    assert z[floor] == pytest.approx(-2.0, abs=3e-4)  # three decimals of a program line, and half of the tolerance


def test_the_body_is_closed_and_has_the_volume_that_is_left(project):
    """Every edge belongs to two triangles, once each way round; a slot of 40 by 10 by 2 mm is missing."""
    assert give(project, "simulate", project / "slot.nc", "--surface", project / "s.stl") == 0
    data = (project / "s.stl").read_bytes()
    (count,) = struct.unpack("<I", data[80:84])
    facets = np.frombuffer(data[84:], np.dtype([("n", "<f4", 3), ("p", "<f4", (3, 3)), ("u", "<u2")]), count)
    p = facets["p"].astype(float)
    volume = float(np.einsum("ij,ij->i", p[:, 0], np.cross(p[:, 1], p[:, 2])).sum() / 6.0)
    assert volume == pytest.approx(40 * 30 * 10 - 40 * 10 * 2, rel=0.01)
    keys = np.round(p, 4)
    edges = {}
    for a, b in ((0, 1), (1, 2), (2, 0)):
        for start, end in zip(map(tuple, keys[:, a]), map(tuple, keys[:, b]), strict=True):
            edges[start, end] = edges.get((start, end), 0) + 1
    assert all(edges.get((b, a), 0) == n for (a, b), n in edges.items())


def test_without_a_stock_there_is_nothing_to_cut(project, capsys):
    (project / "stock.yaml").write_text("control: {resolution_mm: 0.0001}\n")
    assert give(project, "simulate", project / "slot.nc", "--surface", project / "s.csv") == 2
    assert "CC298" in capsys.readouterr().err and not (project / "s.csv").exists()
