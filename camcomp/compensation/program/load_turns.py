"""Where along a track the load of a drive turns round and pushes the carriage through its play.

No set-point corrects the tip there: on one side the carriage lies on one flank, on the other on the other one. The corrected
program leads the drive through the play in one line, which is no part of before, after and verification.
"""

from __future__ import annotations

import numpy as np

from camcomp.compensation.program.line_ends import Span, cut_at, points_along
from camcomp.compensation.program.moves import travel_of
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints
from camcomp.ground.records import dataclass
from camcomp.model.cutting.track import Track
from camcomp.model.job import Job
from camcomp.model.motion.response import LEAST_MM, gives_way, load_flanks, way_per_unit, without_drives

FOUND_MM = 2e-4  # way to which such a place is known
SPACING_MM = 2.0  # between the points at which loads are looked at


@dataclass(frozen=True, eq=False)
class LoadTurns:
    """The places as spans of pieces."""

    spans: list[Span]

    def passed(self, piece: Ints, move: Ints, f: Floats, w: Floats) -> Bools:
        """Which of points (n,) at fractions f of moves, seen at fractions w of pieces, lie inside moves through such places."""
        out = np.zeros(len(piece), np.bool_)
        low, high = np.full((2, int(move.max(initial=0)) + 1), np.nan)
        low[move[f == 0.0]], high[move[f == 1.0]] = w[f == 0.0], w[f == 1.0]
        for i, begin, end in self.spans:
            middle = 0.5 * (begin + end)
            out |= (piece == i) & (low[move] <= middle) & (middle <= high[move]) & (f < 1.0)
        return out

    def cut(self, track: Track) -> Track:
        """Their track with pieces of its own for these places."""
        return cut_at(track, [(i, at) for i, *ends in self.spans for at in ends])

    def warning(self) -> list[str]:
        """A line for the user where there are such places."""
        count = len(self.spans)
        places = "1 place" if count == 1 else f"{count} places"
        text = f"at {places} the load turns round and pushes a drive through its play: not corrected, nor counted in the tip error"
        return [text] if count else []


def load_turns(job: Job, track: Track) -> LoadTurns:
    """The places in corrected feed pieces of a track where loads push carriages through their play."""
    if not gives_way(job):
        return LoadTurns([])
    piece, w = points_along(track, SPACING_MM)
    cuts = (track.path.kind[track.motion[piece]] != RAPID) & (track.length[piece] > 0.0)
    piece, w = piece[cuts], w[cuts]
    flank, stays = _flanks(job, track, piece, w)
    piece, w, flank = piece[stays], w[stays], flank[stays]
    at = np.flatnonzero(_other(job, flank[1:], flank[:-1]) & (np.diff(piece) == 0))
    here = piece[at]
    ends = []
    for side in (0, 1):  # last place on the flank before, first place on the one behind
        low, high = w[at], w[at + 1]
        while len(at) and ((high - low) * track.length[here] > FOUND_MM).any():
            middle = 0.5 * (low + high)
            there, stays = _flanks(job, track, here, middle)
            reached = stays & ~_other(job, there, flank[at + side])
            behind = reached if side == 0 else ~reached
            low, high = np.where(behind, middle, low), np.where(behind, high, middle)
        ends.append(high if side else low)
    return LoadTurns(list(zip(here.tolist(), *(each.tolist() for each in ends), strict=True)))


def _flanks(job: Job, track: Track, piece: Ints, w: Floats) -> tuple[Floats, Bools]:
    """`load_flanks` at fractions w (n,) of pieces; False in the second mask where the machine does not reach."""
    travel = travel_of(job, track, piece, w)
    found = without_drives(job, track.points(piece, w), travel)
    flank, stays = load_flanks(job, found, travel)
    return flank, stays & (found.status == 0)


def _other(job: Job, flank: Floats, before: Floats) -> Bools:
    """Whether (n,) one of the carriages lies on another flank."""
    return np.asarray((np.abs(flank - before) * way_per_unit(job) > LEAST_MM).any(axis=1))
