"""Where drives with play turn round along a track, so that each takes up its play in a short line of its own.

A carriage that turns round stands still while its drive goes through the play. If a line of the corrected program begins
at the turn and ends before the carriage has to move on, the drive goes through its play within that line and the tip
misses nothing.
"""

from __future__ import annotations

import math

import numpy as np

from camcomp.cutting.track import Track
from camcomp.datatypes import RAPID, Bools, Floats, Ints
from camcomp.gap.memory import turning_points
from camcomp.job import Job
from camcomp.moves import corrected_pieces, travel_of
from camcomp.response import LEAST_MM, plays, without_drives
from camcomp.splitting import trial_nodes

STANDING_MM = 2e-4  # way that the carriage should have gone at the end of such a line


def cut_at_reversals(job: Job, track: Track, spacing: float) -> tuple[Track, Bools]:
    """The track with a piece of its own behind every reversal of a drive with play in a feed line, and which pieces those are.

    spacing: distance of the points, mm, at which the carriages are looked at.
    """
    none = np.zeros(len(track.motion), np.bool_)
    corrected = corrected_pieces(track.path, track)
    if not job.causes or not corrected.any():
        return track, none
    trial = trial_nodes(track.length, track.angle, corrected & (track.length > 0.0), spacing)
    on = corrected[trial.piece]
    piece, w = trial.piece[on], trial.w[on]
    travel = travel_of(job, track, piece, w)
    carriage = without_drives(job, track.points(piece, w), travel).rho
    if not np.isfinite(carriage).all():  # told later, with the line
        return track, none
    feed = track.path.kind[track.motion] != RAPID
    lines = {
        line
        for j in np.flatnonzero(plays(job, carriage, travel))
        for k in turning_points(carriage[:, j], LEAST_MM)[0]
        if feed[piece[k]] and (line := _line_behind(piece, w, carriage[:, j], k)) is not None
    }
    cuts = sorted({(i, at) for i, *ends in lines for at in ends if 0.0 < at < 1.0})
    if not cuts:
        return track, none
    divided = track.cut(np.array([i for i, _ in cuts]), np.array([at for _, at in cuts]))
    middle = 0.5 * (divided.u0 + divided.u1)
    out = np.zeros(len(middle), np.bool_)
    for i, a, b in lines:
        u = track.u(np.array([i, i]), np.array([a, b]))
        out |= (divided.motion == track.motion[i]) & (u[0] < middle) & (middle < u[1])
    return divided, out


def _line_behind(piece: Ints, w: Floats, x: Floats, k: int) -> tuple[int, float, float] | None:
    """Piece and fractions between which the drive that turns round at node k takes up its play, from a parabola.

    None where it does so on its way to another piece.
    """
    if k + 1 == len(w) or piece[k + 1] != piece[k]:
        return None
    inner = k > 0 and piece[k - 1] == piece[k]
    first = k - 1 if inner else k
    last = min(first + 2, len(w) - 1)
    if piece[last] != piece[k]:
        last = k + 1
    a, b, _ = np.polyfit(w[first : last + 1] - w[k], x[first : last + 1], 2) if last == first + 2 else (0.0, *_line(w, x, k))
    begin = float(np.clip(-b / (2.0 * a), w[first] - w[k], w[last] - w[k])) if inner and a != 0.0 else 0.0
    slope = 0.0 if inner else abs(b)
    way = 2.0 * STANDING_MM / max(slope + math.sqrt(slope**2 + 4.0 * abs(a) * STANDING_MM), 1e-12)
    start = max(w[k] + begin, 0.0)
    return int(piece[k]), start, min(start + way, 1.0)


def _line(w: Floats, x: Floats, k: int) -> tuple[float, float]:
    return (x[k + 1] - x[k]) / (w[k + 1] - w[k]), x[k]
