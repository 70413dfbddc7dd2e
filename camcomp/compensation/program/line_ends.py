"""Places inside the pieces of a track at which a line has to end: points at which to look for them, and the track cut there."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from camcomp.compensation.program.chords import COARSE_MM, trial_nodes
from camcomp.compensation.program.moves import corrected_pieces
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.model.cutting.track import Track

LEAST = 1e-6  # of a piece: places nearer to each other or to its ends are one

Place = tuple[int, float]  # piece, fraction of it
Span = tuple[int, float, float]  # piece, fractions of it at begin and end


def points_along(track: Track, spacing: float = COARSE_MM) -> tuple[Ints, Floats]:
    """Pieces (k,) and fractions (k,) of points at most `spacing` mm apart on corrected pieces, in the order of travel."""
    corrected = corrected_pieces(track.path, track)
    nodes = trial_nodes(track.length, track.angle, corrected & (track.length > 0.0), spacing)
    on = corrected[nodes.piece]
    return nodes.piece[on], nodes.w[on]


def cut_at(track: Track, places: Iterable[Place]) -> Track:
    """The track with pieces that end at the places."""
    found = sorted({(i, at) for i, at in places if LEAST < at < 1.0 - LEAST})
    if not found:
        return track
    piece, w = (np.array(each) for each in zip(*found, strict=True))
    apart = np.append(True, (np.diff(piece) > 0) | (np.diff(w) > LEAST))
    return track.cut(piece[apart], w[apart])


def pieces_between(track: Track, divided: Track, spans: Iterable[Span]) -> Bools:
    """Which pieces (p,) of a divided track lie in spans of the undivided one."""
    middle, out = 0.5 * (divided.u0 + divided.u1), np.zeros(len(divided.motion), np.bool_)
    for i, *ends in spans:
        low, high = track.u(np.array([i, i]), np.array(ends))
        out |= (divided.motion == track.motion[i]) & (low < middle) & (middle < high)
    return out
