"""Cost of a stock: `python -m pytest tests/benchmarks/test_stock_speed.py -m benchmarks -s`.

Programs of short moves that cut nearly all the way, through a block of 300 x 300 x 60 mm at the default resolution, with
and without the block in turns; ratios within one run, start-up included.
"""

import math
from itertools import islice

import numpy as np
import pytest

from camcomp.ground.files import shipped
from tests.benchmarks.test_speed import against, compensate, table, tell  # noqa: F401 - its table is printed here, too

pytestmark = pytest.mark.benchmarks

LINES = 1_000_000
MACHINE = ["--config", str(shipped("config/cartesian.yaml"))]
BLOCK = """
workpiece: {{stock: {{type: box, min_mm: [-150, -150, -60], max_mm: [150, 150, 0]}}}}
tools: {{1: {{diameter_mm: 6, teeth: 2, type: {tip}}}}}
"""


def pocket(step=3.0, chord=0.12, outer=140.0, down=1.0):
    """Spirals from the middle outwards, level after level, and back to the middle."""
    z = 0.0
    while True:
        z -= down
        angle, radius = 0.0, 1.0
        while radius < outer:
            yield radius * math.cos(angle), radius * math.sin(angle), z
            angle += chord / radius
            radius += step * chord / radius / (2.0 * math.pi)
        while radius > 1.0 + 1e-6:
            radius = max(radius - 10.0 * chord, 1.0)
            yield radius * math.cos(angle), radius * math.sin(angle), z


def surface(step=0.5, chord=0.18, half=145.0):
    """Lines to and fro over waves of 1.4 mm."""
    count = int(2.0 * half / chord)
    for row in range(int(2.0 * half / step) + 1):
        y, side = -half + step * row, 1.0 - 2.0 * (row % 2)
        for k in range(count + 1):
            x = side * (-half + 2.0 * half * k / count)
            yield x, y, -1.5 + 1.4 * math.sin(x / 11.0) * math.cos(y / 13.0)


def write(path, points, lines):
    at = islice(points, lines)
    x, y, z = next(at)
    with open(path, "w", encoding="ascii") as file:
        file.write(
            f"%\nN10 G21 G90 G17 G94\nN20 T1 M6\nN30 S8000 M3\nG0 X{x:.4f} Y{y:.4f} Z5\nG1 Z{z:.4f} F300\nG1 F1200\n"
        )
        file.writelines(f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f}\n" for x, y, z in at)
        file.write("G0 Z5\nM5 M9\nM30\n%\n")


@pytest.mark.parametrize(("name", "points", "tip"), [("pocket", pocket, "flat"), ("surface", surface, "ball")])
def test_a_million_lines_through_a_block(tmp_path, name, points, tip):
    program, block = tmp_path / f"{name}.nc", tmp_path / "block.yaml"
    write(program, points(), LINES)
    block.write_text(BLOCK.format(tip=tip))
    write(tmp_path / "few.nc", points(), 3000)
    ways = (MACHINE, [*MACHINE, "--config", block])
    for way in ways:  # compiled code is on disk from here on
        compensate(tmp_path / "few.nc", *way, "-o", tmp_path / "out.nc")
    made = np.array([[compensate(program, *way, "-o", tmp_path / "out.nc") for way in ways] for _ in range(2)])
    plain, cut = np.median(made, axis=0)
    tell(f"{LINES} lines of a {name}, {tip} tool, block of 300 x 300 x 60 mm", f"{cut[0]:.0f} s, {cut[2]:.0f} MB")
    tell("  times the time without a stock (wanted: 3 at most)", against(cut, plain))
    assert cut[2] < 1000.0
    assert cut[1] < 3.0 * plain[1]
