"""Forces in a pocket against a plant of the tests' own: it cuts its own dexels with its own bent tool, and shares no code."""

import itertools

import numpy as np
import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of
from camcomp.model.job import Job

SPRINGS = np.array([2e4, 2e4, 4e4])  # N/mm, of config/cartesian.yaml
R, TEETH, SPEED, FEED = 5.0, 2, 8000.0, 600.0
KTC, KRC, KAC, KTE, KRE, KAE = 767.0, 169.0, 222.0, 27.7, 26.6, 0.7
CELL, STEP, ANGLES = 0.1, 0.4, 360
CONFIG = f"""
workpiece: {{stock: {{type: box, min_mm: [-20, -20, -9], max_mm: [20, 20, 0]}}}}
tool: {{diameter_mm: {2 * R}, teeth: {TEETH}}}
process: {{force: {{model: mechanistic, Ktc_N_per_mm2: {KTC}, Krc_N_per_mm2: {KRC}, Kac_N_per_mm2: {KAC},
                    Kte_N_per_mm: {KTE}, Kre_N_per_mm: {KRE}, Kae_N_per_mm: {KAE}}}}}
"""
CORNERS = [(-8, -8), (8, -8), (8, 8), (-8, 8), (-8, -4), (4, -4), (4, 4)]
PROGRAM = (
    "G21 G90 G17\nS8000 M3\nG0 X-8 Y-8 Z5\nG1 Z-2 F200\n"
    + "".join(f"G1 X{x} Y{y} F600\n" for x, y in CORNERS[1:])
    + "G0 Z5\nM30\n"
)


class Plant:
    """Dexels 0.1 mm apart, and the mean force of two teeth by summing over the turn."""

    def __init__(self):
        n = round(40.0 / CELL) + 1
        self.x = np.linspace(-20.0, 20.0, n)
        self.top = np.zeros((n, n))

    def depth(self, tip, direction):
        """Angles of the front half and the material over the tip just in front of the edge."""
        psi = (np.arange(ANGLES) + 0.5) / ANGLES * np.pi
        left = np.array([-direction[1], direction[0]])
        q = tip[:2] + (R + 0.5 * CELL) * (np.cos(psi)[:, None] * left + np.sin(psi)[:, None] * direction)
        k = np.rint((q + 20.0) / CELL).astype(int)
        inside = ((k >= 0) & (k < len(self.x))).all(axis=1)
        k = np.clip(k, 0, len(self.x) - 1)
        return psi, np.where(inside, np.maximum(self.top[k[:, 1], k[:, 0]] - tip[2], 0.0), 0.0)

    def force(self, tip, direction):
        psi, depth = self.depth(tip, direction)
        chip = FEED / (TEETH * SPEED) * np.sin(psi)
        share = TEETH * depth / (2.0 * np.pi) * np.pi / ANGLES
        tangential, radial, axial = (share * (c * chip + e) for c, e in ((KTC, KTE), (KRC, KRE), (KAC, KAE)))
        left = np.array([-direction[1], direction[0]])
        outward = np.cos(psi)[:, None] * left + np.sin(psi)[:, None] * direction
        along = -np.sin(psi)[:, None] * left + np.cos(psi)[:, None] * direction  # the tooth moves clockwise
        flat = -(tangential[:, None] * along + radial[:, None] * outward).sum(axis=0)
        return np.append(flat, -axial.sum())

    def cut(self, tip):
        near = (self.x[None, :] - tip[0]) ** 2 + (self.x[:, None] - tip[1]) ** 2 <= R**2
        self.top[near] = np.minimum(self.top[near], tip[2])


def driven(path, wanted):
    """Distances (k,) mm of the bent tip, square to the programmed line, while a program's cuts are driven."""
    plant, out = Plant(), []
    for k in range(len(path)):
        way = path.end[k] - path.start[k]
        length = np.linalg.norm(way[:2])
        if path.kind[k] == 0 or length < 1.5:  # rapids, plunges, joining lines
            if path.kind[k] != 0:
                plant.cut(path.end[k])
            continue
        e = way[:2] / length
        for u in np.arange(STEP, length, STEP) / length:
            told = path.start[k] + u * way
            tip = told.copy()
            for _ in range(3):
                tip = told + plant.force(tip, e) / SPRINGS
            out.append(wanted(tip, e))
            plant.cut(tip)
    return np.array(out)


def beside(tip, e):
    """Distance from the nearest programmed line along the feed, and in height."""
    best = np.inf
    for a, b in itertools.pairwise(CORNERS):
        d = np.subtract(b, a) / np.linalg.norm(np.subtract(b, a))
        if d @ e < 0.9:
            continue
        n = (tip[:2] - a) @ np.array([-d[1], d[0]])
        best = min(best, np.hypot(n, tip[2] + 2.0))
    return best


def test_a_pocket_is_true_on_a_plant_that_cuts_its_own_dexels(tmp_path):
    (tmp_path / "stock.yaml").write_text(CONFIG)
    job = Job(load_config([shipped("config/cartesian.yaml"), tmp_path / "stock.yaml"]))
    program = program_of(PROGRAM.encode(), "p.nc", job.config)
    result = compensate(program, job, method="newton", tolerance_um=1.0, version="1")
    corrected = program_of(result.written.data, "c.nc", job.config)
    before, after = driven(program.path, beside), driven(corrected.path, beside)
    rms = [1e3 * np.sqrt(np.mean(each**2)) for each in (before, after)]
    assert rms[0] > 2.0  # um
    assert rms[1] < 0.12 * rms[0], rms
    assert pytest.approx(0.0, abs=0.3 * rms[0]) == 1e3 * np.percentile(after, 95), rms
