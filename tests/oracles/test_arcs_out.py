"""Corrected programs with arcs, as LinuxCNC reads them: its arcs keep to the path that the loaded machine needs."""

import numpy as np
import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.moves import travel_of
from camcomp.gcode.interpret import read_program
from camcomp.ground.datatypes import ARC
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.cutting.track import lay_track
from camcomp.model.job import Job
from camcomp.model.motion.response import aim_at
from tests.oracles import rs274

pytestmark = rs274.needs_rs274
PRINTED = 0.5e-4 * np.sqrt(3.0)  # mm, by which a printed point is off
PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}

PROGRAMS = {
    "circle": "G0 X25 Y0 Z0\nG3 X25 Y0 I-25 J0 F600\nM2\n",
    "helix": "G0 X20 Y0 Z0\nG2 X20 Y0 Z-6 I-20 J0 P2 F600\nM2\n",
    "quarter in XZ": "G0 X20 Y0 Z0\nG18 G3 X34 Z-5.8579 R20 F600\nM2\n",
    "slot": "G0 X20 Y5 Z0\nG3 X10 Y15 I-10 F600\nG1 X-10\nG3 Y-5 J-10\nG1 X10\nG3 X20 Y5 J10\nM2\n",
}


def points(motion, start):
    """A canonical motion as points (k, 3), mm."""
    end = np.array(motion.end) * motion.unit
    f = np.linspace(0.0, 1.0, 33)[:, None]
    if motion.kind != "ARC":
        return start + f * (end - start)
    u, v, _ = PLANES[motion.plane]
    centre = np.array(motion.centre) * motion.unit
    p, q = start[[u, v]] - centre, end[[u, v]] - centre
    angle = np.arctan2(p[0] * q[1] - p[1] * q[0], p @ q)
    way = np.sign(motion.turns)
    angle = way * (np.mod(way * angle, 2 * np.pi) + 2 * np.pi * (abs(motion.turns) - 1))
    radius = np.linalg.norm(p) + f[:, 0] * (np.linalg.norm(q) - np.linalg.norm(p))
    at = np.arctan2(p[1], p[0]) + f[:, 0] * angle
    out = start + f * (end - start)
    out[:, u], out[:, v] = centre[0] + radius * np.cos(at), centre[1] + radius * np.sin(at)
    return out


def distance(point, curve):
    """Distance of points (n, 3) from a polyline (k, 3)."""
    a, ab = curve[:-1], np.diff(curve, axis=0)
    f = np.clip(np.einsum("nkc,kc->nk", point[:, None] - a, ab) / np.sum(ab**2, axis=1), 0.0, 1.0)
    return np.linalg.norm(point[:, None] - a - f[..., None] * ab, axis=2).min(axis=1)


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("config", ["config/cartesian.yaml", "config/orthoglide-1deg.yaml"])
def test_linuxcnc_follows_the_path_that_is_needed(name, config):
    settings = load_config((str(shipped(config)),))
    job = Job(settings)
    program = read_program(b"G21 G90 G17 G94\n" + PROGRAMS[name].encode(), name="in.nc")
    result = compensate(program, job, method="newton", tolerance_um=1.0, version="0", arcs=True)
    run = rs274.run(result.written.data)
    assert run.error == ""
    kinds = [each.kind for each in run.motions]
    assert len(kinds) == len(result.rows.kind)
    assert [kind == "ARC" for kind in kinds] == (result.rows.kind == ARC).tolist()
    assert "ARC" in kinds

    track = lay_track(program.path, job.conditions)
    start = np.array(run.motions[0].end)
    for row in range(1, len(kinds)):
        way = points(run.motions[row], start)
        start = way[-1]
        if result.rows.joining[row]:
            continue
        piece = np.full(201, result.rows.piece[row])
        same = row > 0 and result.rows.piece[row - 1] == piece[0] and not result.rows.joining[row - 1]
        w = np.linspace(result.rows.w[row - 1] if same else 0.0, result.rows.w[row], 201)
        needed = aim_at(job, track.points(piece, w), travel_of(job, track, piece, w), "newton").commanded
        assert distance(way, needed).max() <= 1e-3 + PRINTED
