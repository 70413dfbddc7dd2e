"""Where drives take up their play along a track, so that each does so in a short line of its own.

A carriage that turns round stands still while its drive goes through the play. If a line of the corrected program begins
at the turn and ends before the carriage has to move on, the drive goes through its play within that line and the tip
misses nothing.

The words X, Y, Z can move three drives one by one, but none of an arm's six alone. After a reversal the other joints lead the
tip while the one that turned round stands: its drive goes through the play on the way, over some millimetres, and where it
has, the commanded path bends, so that a line ends there, too.

Where the load of a drive turns round it pushes the carriage through its play. No set-point corrects the tip there: on one side
the carriage lies on one flank, on the other on the other one. The corrected program leads the drive through the play in one
line, which is no part of before, after and verification.
"""

from __future__ import annotations

import math

import numpy as np

from camcomp.compensation.program.line_ends import (
    Place,
    Span,
    cut_at,
    cut_at_knots,
    cut_at_stops,
    pieces_between,
    points_along,
    trial_spacing,
)
from camcomp.compensation.program.moves import corrected_pieces, travel_of
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints
from camcomp.model.cutting.track import Track
from camcomp.model.hysteresis import turning_points
from camcomp.model.job import Job
from camcomp.model.motion import response
from camcomp.model.motion.response import LEAST_MM, way_per_unit
from camcomp.model.motion.travel import WORDS
from camcomp.model.signal_path import momentary

STANDING_MM = 2e-4  # way that the carriage should have gone at the end of such a line
WINDING_MM = (2e-3, 6e-3, 0.015, 0.04)  # ways over which friction turns round; on arms all
FOUND_MM = 2e-4  # way to which such a place is known
SPACING_MM = 2.0  # between the points at which loads are looked at
STANDS = 0.999  # share of its drive's way that a carriage stays behind, from which on it stands
LOOKS = 2  # each begins where the one before has found the bends
NEAR = 1e-3  # of the way between two points, that are one


def cut_for_drives(job: Job, track: Track) -> tuple[Track, Bools]:
    """The track cut where effects of drives and loops need the end of a line, and pieces in which a drive goes through its play."""
    spacing = trial_spacing(job)
    knotted = cut_at_knots(job, track, spacing)
    reversing, lines = cut_at_reversals(job, knotted, spacing)
    divided = cut_at_stops(job, reversing)
    return divided, pieces_between(knotted, divided, lines)


def cut_at_reversals(job: Job, track: Track, spacing: float) -> tuple[Track, set[Span]]:
    """The track with a piece of its own behind every reversal of a drive with play in a feed line, as spans of the undivided one.

    spacing: distance of the points, mm, at which the carriages are looked at.
    """
    lines: set[Span] = set()
    cuts: set[Place] = set()
    if momentary(job.causes):
        return track, lines
    piece, w = points_along(track, spacing)
    travel = travel_of(job, track, piece, w)
    found = response.without_drives(job, track.points(piece, w), travel)
    if not np.isfinite(found.rho).all():  # told later, with the line
        return track, lines
    feed = track.path.kind[track.motion] != RAPID
    memory, friction = response.plays(job, found, travel), response.winds_up(job, found, travel)
    carriage = found.rho * way_per_unit(job)
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
    if arm and cuts:
        cuts |= _taken_up(job, track, cuts, np.flatnonzero(memory), spacing)
    return cut_at(track, cuts), lines


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


def _taken_up(job: Job, track: Track, turns: set[Place], drives: Ints, spacing: float) -> set[Place]:
    """Where in feed lines one of `drives`, which turn round at `turns`, has gone through its play.

    spacing: distance of the points, mm, between which such a place is looked for.
    """
    per_unit = way_per_unit(job)
    ways = np.zeros(0)
    for _ in range(LOOKS):
        divided = cut_at(track, turns | _in_feed(track, ways))
        piece, w = points_along(divided, spacing)
        travel = travel_of(job, divided, piece, w)
        aimed = response.aim_at(job, divided.points(piece, w), travel, "newton")
        if (aimed.status != 0).any():  # told later, with the line
            return set()
        encoder, behind = response.behind_encoders(job, aimed.commanded, travel)
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


def passed_turns(spans: list[Span], piece: Ints, move: Ints, f: Floats, w: Floats) -> Bools:
    """Which of points (n,) at fractions f of moves, seen at fractions w of pieces, lie inside moves through such places."""
    out = np.zeros(len(piece), np.bool_)
    low, high = np.full((2, int(move.max(initial=0)) + 1), np.nan)
    low[move[f == 0.0]], high[move[f == 1.0]] = w[f == 0.0], w[f == 1.0]
    for i, begin, end in spans:
        middle = 0.5 * (begin + end)
        out |= (piece == i) & (low[move] <= middle) & (middle <= high[move]) & (f < 1.0)
    return out


def turns_warning(spans: list[Span]) -> list[str]:
    """A line for the user where there are such places."""
    places = "1 place" if len(spans) == 1 else f"{len(spans)} places"
    text = f"at {places} the load turns round and pushes a drive through its play: not corrected, nor counted in the tip error"
    return [text] if spans else []


def load_turns(job: Job, track: Track) -> list[Span]:
    """The places in corrected feed pieces of a track where loads push carriages through their play, as spans of pieces."""
    if not response.gives_way(job):
        return []
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
    return list(zip(here.tolist(), *(each.tolist() for each in ends), strict=True))


def _flanks(job: Job, track: Track, piece: Ints, w: Floats) -> tuple[Floats, Bools]:
    """`load_flanks` at fractions w (n,) of pieces; False in the second mask where the machine does not reach."""
    travel = travel_of(job, track, piece, w)
    found = response.without_drives(job, track.points(piece, w), travel)
    flank, stays = response.load_flanks(job, found, travel)
    return flank, stays & (found.status == 0)


def _other(job: Job, flank: Floats, before: Floats) -> Bools:
    """Whether (n,) one of the carriages lies on another flank."""
    return np.asarray((np.abs(flank - before) * way_per_unit(job) > LEAST_MM).any(axis=1))
