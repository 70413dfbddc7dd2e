"""The stock under a tool that is turned: the same part laid down at a slant is cut alike."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from camcomp.gcode.interpret import read_program
from camcomp.gcode.setup import Setup
from camcomp.ground.errors import ConfigError
from camcomp.ground.orientation import TURN, Orientation, pole_free_words
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.stock.field import BOX as BOX_FORM
from camcomp.model.stock.field import ROUND
from camcomp.model.stock.shapes import StockShape
from camcomp.model.stock.tool_frame import ToolFrame
from tests.commandline import ROOT

PART = "G21 G90 G17\nS8000 M3\nG0 X-8 Y0 Z5\nG1 Z-2 F600\nX30\nG3 X40 Y10 I0 J10\nG1 Y30\nX-8\nG0 Z5\nM2\n"
STOCK = (
    "workpiece: {{stock: {stock}}}\ntool: {{diameter_mm: 10, teeth: 2, type: flat}}\nprocess: {{spindle_rpm: 8000}}\n"
)
BOX, BAR = (
    "{type: box, min_mm: [0, -10, -9], max_mm: [50, 35, 0]}",
    "{type: cylinder, centre_mm: [20, 10], diameter_mm: 50, bottom_mm: -9, top_mm: 0}",
)


def job_of(folder, stock):
    (folder / "stock.yaml").write_text(STOCK.format(stock=stock))
    return Job(load_config([ROOT / "config" / "kuka-kr210.yaml", folder / "stock.yaml"]))


def laid_down(path, rotation):
    """The path turned as a whole, and the tool with it."""
    R, n = rotation.as_matrix(), len(path)
    words = np.tile(pole_free_words(R[None])[0], (n, 1))
    turned = {name: getattr(path, name) @ R.T for name in ("start", "end", "centre", "axis")}
    return replace(path, **turned, orientation=Orientation(TURN, words, words))


@pytest.mark.parametrize("stock", [BOX, BAR])
def test_a_part_at_a_slant_is_cut_like_the_part(tmp_path, stock):
    job = job_of(tmp_path, stock)
    path = read_program(PART.encode(), name="in.nc", setup=Setup()).path
    upright = job.conditions.engage(path)
    rotation = Rotation.from_euler("ZYX", [20, 0, 25], degrees=True)
    turned = laid_down(path, rotation)
    # the stock is laid down as well: as a closed body in a file
    low, high = ([0, -10, -9], [50, 35, 0]) if stock == BOX else ([-5, -15, -9], [45, 35, 0])
    body = StockShape(np.array(low, float), np.array(high, float), BOX_FORM if stock == BOX else ROUND)
    file = tmp_path / "part.stl"
    write_stl(file, ToolFrame(rotation.as_matrix(), 0.0).shape(body).mesh)
    slanted = job_of(tmp_path, f"{{type: stl, file: {file}}}").conditions.engage(turned)
    u = np.linspace(0.02, 0.98, 25)
    for motion in (4, 5, 6, 7):
        at = np.full(len(u), motion - 1)
        one, other = upright.sizes(at, u, u < 0), slanted.sizes(at, u, u < 0)
        assert np.isfinite(one[0]).any()
        inside = one[0] > 1.9
        np.testing.assert_allclose(other[0][inside], one[0][inside], atol=0.01)
        assert np.median(np.abs(other[1] - one[1])) < 0.02


def write_stl(file, mesh):
    lines = ["solid part"]
    for triangle in mesh:
        corners = [f"vertex {x:.6f} {y:.6f} {z:.6f}" for x, y, z in triangle]
        lines += ["facet normal 0 0 0", "outer loop", *corners, "endloop", "endfacet"]
    file.write_text("\n".join([*lines, "endsolid part\n"]))


def test_a_tool_that_swings_has_no_frame(tmp_path):
    job = job_of(tmp_path, BOX)
    text = PART.replace("X30\n", "X30 A12\n")
    path = read_program(text.encode(), name="in.nc", setup=Setup(orients=True)).path
    with pytest.raises(ConfigError, match="it leans by 6.0"):
        job.conditions.engage(path)
    job.conditions.engage(
        read_program(text.replace("A12", "A4").encode(), name="in.nc", setup=Setup(orients=True)).path
    )
