"""The walls that a bending tool leaves, against a plant that cuts tooth by tooth, without directions or arcs.

The springs are so soft that the first pass is two tenths of a millimetre off: later passes graze what it left, where the arc
grows with the square root of what stands, and behind the corner the tool needs some way to come out of its bend.
"""

import itertools
import sys

import numpy as np
import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.loaded_cut import loaded_cut
from camcomp.ground.datatypes import RAPID
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of
from camcomp.model.job import Job
from camcomp.model.stock.front import EDGE
from camcomp.model.stock.walls import heights

R, TEETH, SPEED, FEED, SPRING = 2.0, 2, 8000.0, 600.0, 400.0
KTC, KRC, KTE, KRE = 767.0, 169.0, 27.7, 26.6
CONFIG = f"""
robot:
  chains:
    xyz:
      elements:
        - {{type: actuator, name: x, joint: prismatic, axis: x, stiffness_N_per_mm: {SPRING}, limits_mm: [-900, 900]}}
        - {{type: actuator, name: y, joint: prismatic, axis: y, stiffness_N_per_mm: {SPRING}, limits_mm: [-900, 900]}}
        - {{type: actuator, name: z, joint: prismatic, axis: z, stiffness_N_per_mm: 1.0e+7, limits_mm: [-900, 900]}}
workpiece: {{stock: {{type: box, min_mm: [-20, -20, -9], max_mm: [20, 20, 0]}}}}
tool: {{diameter_mm: {2 * R}, teeth: {TEETH}}}
process: {{force: {{model: mechanistic, Ktc_N_per_mm2: {KTC}, Krc_N_per_mm2: {KRC}, Kac_N_per_mm2: 0,
                    Kte_N_per_mm: {KTE}, Kre_N_per_mm: {KRE}, Kae_N_per_mm: 0}}}}
"""
DEPTH, ANGLES = 3.0, 240
SKIN = 1e-3  # mm of chip over which an edge begins to press
LAPS = [[(-3.0, -out), (out, -out), (out, 3.0)] for out in (1.5, 2.1, 2.12)]
STATIONS = np.linspace(-2.5, 2.5, 11)
TURN = (np.arange(ANGLES) + 0.5) / ANGLES * 2.0 * np.pi
OUT = np.column_stack((np.cos(TURN), np.sin(TURN)))
ALONG = np.column_stack((np.sin(TURN), -np.cos(TURN)))  # a tooth moves clockwise


class Plant:
    """A tool on two springs. at (n, 2): where its axis stood at the passes of its teeth, all of them as deep."""

    def __init__(self):
        self.at = np.zeros((0, 2))

    def free(self, q):
        """Which points (m, 2) the tool has been over."""
        return (((q[:, None, :] - self.at) ** 2).sum(axis=2) < R**2).any(axis=1)

    def force(self, tip):
        """Mean force (2,) of a turn and its slope (2, 2): a tooth takes off what stands within the tool on its ray."""
        near = self.at[((self.at - tip) ** 2).sum(axis=1) < 4.0 * R**2] - tip
        along = near @ OUT.T
        square = along**2 - (near**2).sum(axis=1)[:, None] + R**2
        reach = np.where(square >= 0.0, along + np.sqrt(np.maximum(square, 0.0)), 0.0).max(axis=0)
        chip = np.maximum(R - reach, 0.0)
        edge, rises = np.clip(chip / SKIN, 0.0, 1.0), ((chip > 0.0) & (chip < SKIN)) / SKIN
        share = TEETH * DEPTH / ANGLES
        press = (KTC * chip + KTE * edge)[:, None] * ALONG + (KRC * chip + KRE * edge)[:, None] * OUT
        more = (KTC * (chip > 0.0) + KTE * rises)[:, None] * ALONG + (KRC * (chip > 0.0) + KRE * rises)[:, None] * OUT
        return -share * press.sum(axis=0), -share * more.T @ OUT

    def drive(self, corners):
        self.at = np.vstack((self.at, corners[0]))
        tip = np.array(corners[0])
        for a, b in itertools.pairwise(map(np.array, corners)):
            length = np.linalg.norm(b - a)
            for told in np.linspace(a, b, round(length * TEETH * SPEED / FEED) + 1)[1:]:
                for _ in range(40):
                    force, slope = self.force(tip)
                    step = np.linalg.solve(SPRING * np.eye(2) - slope, force - SPRING * (tip - told))
                    tip = tip + step * min(1.0, 0.01 / max(np.linalg.norm(step), 1e-12))
                    if np.abs(step).max() < 1e-6:
                        break
                self.at = np.vstack((self.at, tip))


def walls(free):
    """Places (2, n) mm of the walls below and right of the corner. free: which points (m, 2) nothing stands over."""
    out = []
    for of in (lambda far: np.column_stack((STATIONS, -far)), lambda far: np.column_stack((far, STATIONS))):
        low, high = np.full(len(STATIONS), 3.0), np.full(len(STATIONS), 6.0)
        for _ in range(24):
            middle = 0.5 * (low + high)
            gone = free(of(middle))
            low, high = np.where(gone, middle, low), np.where(gone, high, middle)
        out.append(low)
    return np.array(out)


def text_of(laps):
    text = "G21 G90 G17\nS8000 M3\n"
    for lap in laps:
        (x, y), *rest = lap
        text += f"G0 X{x} Y{y} Z5\nG1 Z-{DEPTH} F200\n" + "".join(f"G1 X{x} Y{y} F600\n" for x, y in rest) + "G0 Z5\n"
    return text + "M30\n"


def by_camcomp(job, laps, step):
    cut = loaded_cut(job, program_of(text_of(laps).encode(), "p.nc", job.config), step)
    cut.memory.settle()
    return walls(lambda q: heights(cut.memory, q) < -0.5 * DEPTH)


@pytest.mark.parametrize("sense", [pytest.param(1, marks=pytest.mark.campaign), -1], ids=["out", "back"])
def test_walls_of_a_bending_tool_are_those_of_a_plant_that_keeps_all_its_ways(tmp_path, sense):
    (tmp_path / "soft.yaml").write_text(CONFIG)
    job = Job(load_config([shipped("config/cartesian.yaml"), tmp_path / "soft.yaml"]))
    laps = [lap[::sense] for lap in LAPS]
    plant = Plant()
    for lap in laps:
        plant.drive(lap)
    wanted = walls(plant.free)
    meant = 4.12
    assert np.abs(wanted - meant).max() > 5e-2  # mm: something to find
    off = {step: np.abs(by_camcomp(job, laps, step) - wanted) for step in (1.0, 0.25)}
    assert np.median(off[0.25]) < EDGE
    assert off[0.25].mean() < 0.2 * np.abs(wanted - meant).mean()
    assert off[0.25].mean() < 0.6 * off[1.0].mean()


SHORT = [
    [(-3.0, -1.5), (1.5, -1.5), (1.5, 3.0)], [(-3.0, -1.9), (1.9, -1.9), (2.1, -2.1), (2.1, 3.0)],
    *2 * [[(-3.0, -2.1), (2.1, -2.1), (2.1, 3.0)]],
]  # fmt: skip


def laps_of(path):
    """Corners of the ways at depth between rapids."""
    out, lap = [], []
    for kind, end in zip(path.kind, path.end, strict=True):
        if kind == RAPID:
            out, lap = out + [lap] * (len(lap) > 1), []
        elif end[2] < -0.9 * DEPTH and not (lap and np.allclose(lap[-1], end[:2], atol=1e-9)):
            lap.append(end[:2])
    return out


def in_the_corner(free):
    """Distance (n,) mm from the last corner to the material, on rays into it."""
    turn = np.radians(np.arange(-85.0, 0.0, 10.0))
    rays = np.column_stack((np.cos(turn), np.sin(turn)))
    low, high = np.full(len(rays), 0.8 * R), np.full(len(rays), 1.5 * R)
    for _ in range(20):
        middle = 0.5 * (low + high)
        gone = free(SHORT[-1][1] + middle[:, None] * rays)
        low, high = np.where(gone, middle, low), np.where(gone, high, middle)
    return low


@pytest.mark.parametrize(
    ("spring", "corrected", "within"),
    [pytest.param(600.0, False, 25e-3, marks=pytest.mark.campaign), (1000.0, True, 10e-3)],
)
def test_a_corner_is_reached_over_a_line_shorter_than_the_way_on_which_the_bend_changes(
    tmp_path, monkeypatch, spring, corrected, within
):
    """The tip goes along it; by the plant the corrected program clears the corner."""
    monkeypatch.setattr(sys.modules[__name__], "SPRING", spring)
    (tmp_path / "soft.yaml").write_text(CONFIG.replace("400.0", str(spring)))
    job = Job(load_config([shipped("config/cartesian.yaml"), tmp_path / "soft.yaml"]))
    program = program_of(text_of(SHORT).encode(), "p.nc", job.config)
    if corrected:
        result = compensate(program, job, method="newton", tolerance_um=1.0, version="1")
        program = program_of(result.written.data, "c.nc", job.config)
    plant = Plant()
    for lap in laps_of(program.path):
        plant.drive(lap)
    cut = loaded_cut(job, program)
    cut.memory.settle()
    wanted, found = in_the_corner(plant.free), in_the_corner(lambda q: heights(cut.memory, q) < -0.5 * DEPTH)
    assert np.abs(found - wanted).mean() < within
    if corrected:
        assert wanted.min() > R - within
    else:
        assert wanted.min() < R - within  # something to find
