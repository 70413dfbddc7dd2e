"""Where drives with play turn round along a track, so that each takes up its play in a short line of its own.

A carriage that turns round stands still while its drive goes through the play. If a line of the corrected program begins
at the turn and ends before the carriage has to move on, the drive goes through its play within that line and the tip
misses nothing.
"""

from __future__ import annotations

import math

import numpy as np

from camcomp.compensation.program.line_ends import Place, Span, cut_at, pieces_between, points_along
from camcomp.compensation.program.moves import travel_of
from camcomp.compensation.program.taken_up import taken_up
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints
from camcomp.model.cutting.track import Track
from camcomp.model.hysteresis import turning_points
from camcomp.model.job import Job
from camcomp.model.motion.response import LEAST_MM, WORDS, plays, way_per_unit, winds_up, without_drives
from camcomp.model.signal_path import momentary

STANDING_MM = 2e-4  # way that the carriage should have gone at the end of such a line
WINDING_MM = (
    2e-3,
    6e-3,
    0.015,
    0.04,
)  # ways over which friction turns round, where the correction bends most; on arms all


def cut_at_reversals(job: Job, track: Track, spacing: float) -> tuple[Track, Bools]:
    """The track with a piece of its own behind every reversal of a drive with play in a feed line, and which pieces those are.

    spacing: distance of the points, mm, at which the carriages are looked at.
    """
    none = np.zeros(len(track.motion), np.bool_)
    if momentary(job.causes):
        return track, none
    piece, w = points_along(track, spacing)
    travel = travel_of(job, track, piece, w)
    found = without_drives(job, track.points(piece, w), travel)
    if not np.isfinite(found.rho).all():  # told later, with the line
        return track, none
    feed = track.path.kind[track.motion] != RAPID
    memory, friction = plays(job, found, travel), winds_up(job, found, travel)
    carriage = found.rho * way_per_unit(job)
    lines: set[Span] = set()
    cuts: set[Place] = set()
    arm = carriage.shape[1] > WORDS
    for j in np.flatnonzero(memory):
        for k in turning_points(carriage[:, j], LEAST_MM)[0]:
            k += int(k + 1 < len(w) and piece[k + 1] != piece[k])  # it turns round where the next piece starts
            if not feed[piece[k]] or k + 1 == len(w) or piece[k + 1] != piece[k]:
                continue
            begin, *ends = _fractions(
                piece, w, carriage[:, j], k, (STANDING_MM, *(WINDING_MM if friction[j] or arm else ()))
            )
            if not _short(track, int(piece[k]), begin, ends[0]):
                continue  # a line that is not divided cannot stand for it
            lines.add((int(piece[k]), begin, ends[0]))
            cuts.update((int(piece[k]), at) for at in (begin, *ends))
    if not cuts:
        return track, none
    if arm and memory.any():
        cuts |= taken_up(job, track, cuts, np.flatnonzero(memory), spacing)
    divided = cut_at(track, cuts)
    return divided, pieces_between(track, divided, lines)


def _short(track: Track, piece: int, begin: float, end: float) -> bool:
    """Whether this part of a piece may be one line: less than the whole, and without a bend that other drives go round."""
    a, b, c = track.points(np.full(3, piece), np.array([begin, 0.5 * (begin + end), end]))
    return (begin > 0.0 or end < 1.0) and float(np.linalg.norm(b - 0.5 * (a + c))) <= 5.0 * STANDING_MM


def _fractions(piece: Ints, w: Floats, x: Floats, k: int, ways: tuple[float, ...]) -> list[float]:
    """Where in its piece the drive turns round near node k, and where it has come back by each of `ways`; by a parabola."""
    inner = k > 0 and piece[k - 1] == piece[k]
    first = k - 1 if inner else k
    last = first + 2 if first + 2 < len(w) and piece[first + 2] == piece[k] else k + 1
    degree = last - first
    a, b = [0.0, *np.polyfit(w[first : last + 1] - w[k], x[first : last + 1], degree)][-3:-1]
    begin = float(np.clip(-b / (2.0 * a), w[first] - w[k], w[last] - w[k])) if inner and a != 0.0 else 0.0
    slope, curve = (0.0 if inner else abs(b)), 4.0 * abs(a)
    start = max(w[k] + begin, 0.0)
    return [
        start,
        *(min(start + 2.0 * way / max(slope + math.sqrt(slope**2 + curve * way), 1e-12), 1.0) for way in ways),
    ]
