"""Where the drives of an arm have gone through their play, so that a line ends there.

The words X, Y, Z can move three drives one by one, but none of an arm's six alone. After a reversal the other joints lead the
tip while the one that turned round stands: its drive goes through the play on the way, over some millimetres, and where it
has, the commanded path bends.
"""

from __future__ import annotations

import numpy as np

from camcomp.compensation.program.line_ends import Place, cut_at, points_along
from camcomp.compensation.program.moves import corrected_pieces, travel_of
from camcomp.ground.datatypes import RAPID, Floats, Ints
from camcomp.model.cutting.track import Track
from camcomp.model.job import Job
from camcomp.model.motion.response import LEAST_MM, aim_at, behind_encoders, way_per_unit

STANDS = 0.999  # share of its drive's way that a carriage stays behind, from which on it stands
LOOKS = 2  # each begins where the one before has found the bends
NEAR = 1e-3  # of the way between two points, that are one


def taken_up(job: Job, track: Track, turns: set[Place], drives: Ints, spacing: float) -> set[Place]:
    """Where in feed lines one of `drives`, which turn round at `turns`, has gone through its play.

    spacing: distance of the points, mm, between which such a place is looked for.
    """
    per_unit = way_per_unit(job)
    ways = np.zeros(0)
    for _ in range(LOOKS):
        divided = cut_at(track, turns | _in_feed(track, ways))
        piece, w = points_along(divided, spacing)
        travel = travel_of(job, divided, piece, w)
        aimed = aim_at(job, divided.points(piece, w), travel, "newton")
        if (aimed.status != 0).any():  # told later, with the line
            return set()
        encoder, behind = behind_encoders(job, aimed.commanded, travel)
        way, first = np.unique(divided.s0[piece] + w * divided.length[piece], return_index=True)
        ends = [
            _ends_of_standing(way, encoder[first, j], behind[first, j], LEAST_MM / per_unit[j]) for j in drives.tolist()
        ]
        found = np.array(sorted(at for each in ends for at in each))
        # where it was found to the last digit, it does not show any more
        lost = [at for at in ways if not (np.abs(found - at) < 0.5 * spacing).any()]
        ways = np.array(sorted([*found, *lost]))
    return _in_feed(track, ways)


def _in_feed(track: Track, ways: Floats) -> set[Place]:
    """The places inside corrected feed pieces, of those at `ways` (k,) mm along the path."""
    feed = corrected_pieces(track.path, track) & (track.path.kind[track.motion] != RAPID)
    out: set[Place] = set()
    for at in ways:
        i = int(np.searchsorted(track.s0, at, side="right")) - 1
        share = (at - track.s0[i]) / max(float(track.length[i]), 1e-9)
        if feed[i] and NEAR < share < 1.0 - NEAR:
            out.add((i, float(share)))
    return out


def _ends_of_standing(way: Floats, x: Floats, behind: Floats, least: float) -> list[float]:
    """Ways, rising, at which a carriage that stood while its drive went on by `least` moves on.

    x, behind (n,): the drive, and by how much the carriage differs from it.
    Between two points the drive goes on as before, and the carriage stands until it stays behind no more.
    """
    step, held, along = np.diff(x), -np.diff(behind), np.diff(way)
    standing = (np.abs(held) >= STANDS * np.abs(step)) & (step != 0.0) & (held * step > 0.0)
    since = np.maximum.accumulate(
        np.where(standing, 0, np.arange(len(standing)) + 1)
    )  # first point of the standing so far
    out = []
    for i in np.flatnonzero(standing[:-1] & ~standing[1:]):
        if abs(behind[i + 1] - behind[since[i]]) < least:
            continue
        rate = step[i] / along[i]
        bend = 0.0  # of the drive's way, where two steps before show it
        if i > 0 and standing[i - 1] and step[i - 1] * step[i] > 0.0:
            bend = 2.0 * (rate - step[i - 1] / along[i - 1]) / (along[i] + along[i - 1])
        rate += 0.5 * bend * along[i]
        missing = held[i + 1]
        share = missing / rate if missing * rate > 0.0 else 0.0
        share = missing / (rate + 0.5 * bend * share) if share else 0.0
        out.append(float(way[i + 1] + min(max(share, 0.0), along[i + 1])))
    return out
