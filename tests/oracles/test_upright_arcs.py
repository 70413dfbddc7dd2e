"""Arcs in G18 and G19 whose ends are rounded or that climb: the machine cuts them, wherever their direction turns over.

Truth: the curve is differenced point by point, its tangent across the tool gives the direction of the force, and the loaded
poses are minima of the energy.
"""

import numpy as np
import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.verify import verify
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of
from camcomp.model.job import Job
from tests.validation.plants import energy
from tests.validation.plants.legs import orthoglide
from tests.validation.plants.machine import ORIGIN, TRIPLE

ROLLED, NOMINAL = orthoglide(roll_deg=1.0), orthoglide()
# words, start, centre, and about how far round; planes (u, v, w) of G18 and G19 are (z, x, y) and (y, z, x)
ARCS = {
    "vertical beside its start": ("G18 G3 X7.0 Z-6.001 I6 K0", [1, 0, 0], [7, 0, 0], 1.5 * np.pi),
    "vertical beside its middle": ("G18 G2 X12.995 Z0.003 I6 K0", [1, 0, 0], [7, 0, 0], -np.pi - 0.0005),
    "spiral of a whole turn": ("G19 G3 Y0.004 Z0.003 J2 K-3", [1, 0, 0], [1, 2, -3], 2 * np.pi),
    "climbs by its rounding": ("G18 G3 X7.0 Y0.001 Z-6 I6 K0", [1, 0, 0], [7, 0, 0], 1.5 * np.pi),
    "climbs": ("G18 G3 X1 Y2 Z0 I6 K0", [1, 0, 0], [7, 0, 0], 2 * np.pi),
}


def job_of(name="orthoglide-1deg"):
    return Job(load_config([shipped(f"config/{name}.yaml")]))


def compensated(job, words, tolerance_um=1.0):
    text = f"G21 G90\nG0 X1 Y0 Z0\n{words} F600\nG0 Z40\nM30\n"
    program = program_of(text.encode(), "p.nc", job.config)
    return program, compensate(program, job, method="newton", tolerance_um=tolerance_um, version="0")


class Curve:
    """A spiral that climbs, from its start to a programmed end."""

    def __init__(self, words, start, centre, way) -> None:
        plane = (2, 0, 1) if "G18" in words else (1, 2, 0)
        end = np.array(start, float)
        for word in words.split()[2:]:
            if word[0] in "XYZ":
                end["XYZ".index(word[0])] = float(word[1:])
        self.u, self.v, self.w = plane
        self.centre, self.start, self.end = np.array(centre, float), np.array(start, float), end
        a, b = self.start - self.centre, end - self.centre
        self.radii = [np.hypot(each[self.u], each[self.v]) for each in (a, b)]
        self.begin = np.arctan2(a[self.v], a[self.u])
        turn = np.arctan2(b[self.v], b[self.u]) - self.begin
        self.angle = turn + 2 * np.pi * np.round((way - turn) / (2 * np.pi))

    def at(self, share):
        """Points (n, 3) at shares (n,) of the sweep."""
        radius = self.radii[0] + share * (self.radii[1] - self.radii[0])
        phi = self.begin + share * self.angle
        out = np.empty((len(share), 3))
        out[:, self.u] = self.centre[self.u] + radius * np.cos(phi)
        out[:, self.v] = self.centre[self.v] + radius * np.sin(phi)
        out[:, self.w] = self.start[self.w] + share * (self.end[self.w] - self.start[self.w])
        return out

    def along(self, share):
        """Directions (n, 3)."""
        step = 1e-8
        out = self.at(share + step) - self.at(share - step)
        return out / np.linalg.norm(out, axis=1, keepdims=True)

    def slant(self, share):
        """Sines (n,) of the angles to the tool axis."""
        return np.linalg.norm(self.along(share)[:, :2], axis=1)

    def force(self, share):
        """Forces (n, 3) N on the tool."""
        along = self.along(share) * [1.0, 1.0, 0.0] / self.slant(share)[:, None]
        right = np.cross(along, [0.0, 0.0, 1.0])
        return right * TRIPLE[0] + along * TRIPLE[1] + np.array([0, 0, TRIPLE[2]])


@pytest.mark.parametrize("name", ARCS)
def test_the_machine_cuts_the_curve(name):
    words, start, centre, way = ARCS[name]
    curve, job = Curve(words, start, centre, way), job_of()
    program, result = compensated(job, words)
    rows = result.rows
    ends = np.concatenate((program.path.start[:1], result.written.end))
    before = np.concatenate((program.path.start[:1], rows.target))
    moves = np.flatnonzero((result.lines == 3) & ~rows.joining)
    f = np.linspace(0.02, 0.98, 7)
    told = (ends[moves, None] + f[:, None] * (ends[moves + 1] - ends[moves])[:, None]).reshape(-1, 3)
    place = (before[moves, None] + f[:, None] * (before[moves + 1] - before[moves])[:, None]).reshape(-1, 3)
    near = place - curve.centre
    phi = np.arctan2(near[:, curve.v], near[:, curve.u]) - curve.begin
    share = np.repeat((moves - moves[0]) / len(moves), len(f)) * curve.angle
    share = (phi + 2 * np.pi * np.round((share - phi) / (2 * np.pi))) / curve.angle
    share = np.clip(share, 1e-6, 1.0 - 1e-6)
    slanted = curve.slant(share) > 2e-3  # nearer to the vertical the direction is that of its side
    for _ in range(4):  # the nearest place of the curve, and the force that acts there
        tip = energy.settle(ROLLED, energy.inverse(NOMINAL, told + ORIGIN), curve.force(share)).tip - ORIGIN
        step = 1e-6
        along = (curve.at(share + step) - curve.at(share - step)) / (2 * step)
        share = share + np.sum((tip - curve.at(share)) * along, axis=1) / np.sum(along**2, axis=1)
        share = np.clip(share, 1e-6, 1.0 - 1e-6)
    miss = 1e3 * np.linalg.norm(tip - curve.at(share), axis=1)
    assert miss[slanted].max() < 1.1
    assert slanted.sum() > 0.5 * len(miss)
    checked = verify(program_of(result.written.data, "c.nc", job.config), program, job)
    assert 1e3 * checked.residual.max() < 1.01


@pytest.mark.parametrize("words", ["G17 G3 X1 Y0 Z-9 I3 P6", "G18 G3 X1 Y6 Z0 I3 P6", "G19 G2 X1 Y0 Z0 J3 K1 P6"])
def test_many_turns_take_as_many_points_as_the_tolerance_wants(words):
    count = {um: len(compensated(job_of("cartesian"), words, um)[1].rows.w) for um in (4.0, 1.0)}
    assert 1.6 < count[1.0] / count[4.0] < 2.3
    assert count[1.0] < 6 * 160  # a turn of 3 mm: 93 chords of 1 um, and where the force turns round in it
