"""How few straight lines follow a curve within a tolerance, whoever divides it: what a division is measured by."""

import math

import numpy as np

from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.moves import travel_of
from camcomp.ground.datatypes import ARC
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import open_program
from camcomp.model.cutting.track import lay_track
from camcomp.model.job import Job
from camcomp.model.motion.response import aim_at

LEVELS = 4  # steps of a vertex to either side of the curve


def by_curvature(points: np.ndarray, tolerance: float) -> int:
    """Lower bound: a line whose ends and middle all miss by the tolerance covers h = 4 (tolerance / curvature)^1/2."""
    before, after = points[1:-1] - points[:-2], points[2:] - points[1:-1]
    a, b = np.linalg.norm(before, axis=1), np.linalg.norm(after, axis=1)
    turn = np.linalg.norm(after / b[:, None] - before / a[:, None], axis=1)
    step = 0.5 * (a + b)
    return math.ceil(float(np.sum(np.sqrt(turn / step / (16.0 * tolerance)) * step)))


def by_reach(points: np.ndarray, tolerance: float) -> int:
    """Lines whose vertices stand anywhere within the tolerance, at `points` (n, 3) or near them, found by search.

    From every state (a vertex at one of several distances from the curve) all lines that keep the points in between
    within the tolerance are tried; of the ends that so many lines reach, the farthest of every distance goes on.
    """
    side = np.gradient(np.gradient(points, axis=0), axis=0)
    along = np.gradient(points, axis=0)
    side -= along * (np.sum(side * along, axis=1) / np.sum(along**2, axis=1))[:, None]
    side /= np.linalg.norm(side, axis=1)[:, None]
    offset = np.linspace(-1.0, 1.0, 2 * LEVELS + 1) * tolerance
    vertex = points[:, None] + offset[None, :, None] * side[:, None]  # (n, levels, 3)
    reach = {level: 0 for level in range(len(offset))}
    lines = 0
    while max(reach.values()) < len(points) - 1:
        lines += 1
        farthest: dict[int, int] = {}
        for level, at in reach.items():
            for other, stop in _ends(points, vertex, at, level, tolerance).items():
                farthest[other] = max(farthest.get(other, 0), stop)
        if max(farthest.values(), default=0) <= max(reach.values()):
            raise ValueError("the points stand too far apart for this tolerance")
        reach = farthest
    return lines


def _ends(points: np.ndarray, vertex: np.ndarray, at: int, level: int, tolerance: float) -> dict[int, int]:
    """The farthest end at every distance from the curve that one line reaches."""
    window = 16
    while True:
        stop = min(at + window, len(points) - 1)
        way = vertex[at + 1 : stop + 1] - vertex[at, level]  # (w, levels, 3)
        unit = way / np.linalg.norm(way, axis=2, keepdims=True)
        between = points[at : stop + 1] - vertex[at, level]  # (w + 1, 3)
        along = np.einsum("wlc,kc->wlk", unit, between)
        square = np.sum(between**2, axis=1)[None, None] - along**2
        k, w = np.arange(at, stop + 1), np.arange(at + 1, stop + 1)
        off = np.where(k[None, None] <= w[:, None, None], square, 0.0).max(axis=2)
        good = off <= (tolerance * (1.0 + 1e-6)) ** 2
        if not good[-1].any() or stop == len(points) - 1:
            return {int(j): int(w[np.flatnonzero(good[:, j])[-1]]) for j in np.flatnonzero(good.any(axis=0))}
        window *= 2


def groove(radius, config="config/orthoglide-1deg.yaml", tolerance_um=1.0, arcs=False):
    """Lines of camcomp for a sample groove (named by its diameter or radius), and the fewest by two ways of counting."""
    settings = load_config((str(shipped(config)),))
    job = Job(settings)
    program = open_program(str(shipped(f"samples/groove-circle-{radius}.nc")), settings)
    result = compensate(program, job, method="newton", tolerance_um=tolerance_um, version="0", arcs=arcs)
    arc = int(np.flatnonzero(program.path.kind == ARC)[0])
    lines = int(((result.rows.motion == arc) & ~result.rows.joining).sum())
    assert 1e3 * np.linalg.norm(result.after, axis=1).max() <= tolerance_um

    track = lay_track(program.path, job.conditions)
    w = np.linspace(0.0, 1.0, 24 * lines + 1)  # the path that the loaded machine has to be sent along, densely
    piece = np.full(len(w), arc)
    exact = aim_at(job, track.points(piece, w), travel_of(job, track, piece, w), "newton").commanded
    return lines, by_reach(exact, 1e-3 * tolerance_um), by_curvature(exact, 1e-3 * tolerance_um)
