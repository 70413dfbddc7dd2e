"""Moves of a corrected program: corrected pieces, joining lines, unsupported cases.

Shared by `compensate` and `verify`.
"""

from __future__ import annotations

import numpy as np

from camcomp.gcode.program import Program
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints, Path
from camcomp.ground.errors import Location, PhysicsError, raise_all
from camcomp.ground.records import dataclass
from camcomp.ground.vectors import chosen
from camcomp.model.cutting.track import Track
from camcomp.model.job import Job
from camcomp.model.motion.response import AROUND_S
from camcomp.model.motion.travel import Travel
from camcomp.model.oriented import platform_rotations
from camcomp.model.statics.masses import has_moved_mass
from camcomp.model.statics.solve import STATUS

RULE_OF_STATUS = {2: "CC301", 3: "CC302", 4: "CC303", 5: "CC304"}
MOST_ERRORS = 20
WITHIN_RAPID = np.arange(1, 8) / 8.0  # where a rapid is looked at when drives remember how they came
SAME_SPEED = 1e-6  # of two pieces that belong to one smooth stretch
RAPID_FEED = 10_000.0  # mm/min, for the time that rapids take


@dataclass(frozen=True, eq=False)
class Layout:
    """Which pieces (p,) are corrected, and which get a joining line in front of or behind them."""

    corrected: Bools
    leading: Bools
    trailing: Bools


def row_layout(path: Path, track: Track, step: Floats, resolution: float) -> Layout:
    """Corrected pieces and joining lines of a track.

    step (p,) mm: how far the commanded tip jumps at the start of each piece; a jump below the resolution needs no line. A
    joining line stands in front of the piece behind the jump; in front of a rapid or an uncorrected move it stands
    behind the cut instead, because only feed lines can join. The program starts uncorrected, and a move in machine
    coordinates ends so; the feed line behind them needs one too.
    """
    corrected = corrected_pieces(path, track)
    feed = corrected & (path.kind[track.motion] != RAPID)
    jumps = track.jump & np.concatenate(([False], corrected[:-1])) & (step > resolution)
    behind_uncorrected = np.concatenate(([True], ~corrected[:-1])) & (step > resolution)
    leading = (jumps | behind_uncorrected) & feed
    trailing = np.concatenate((jumps[1:] & ~leading[1:], [False])) & feed
    return Layout(corrected, leading, trailing)


def error_goals(tolerance_um: float, step_mm: float, correction: Floats) -> Floats:
    """Largest error (p,) mm that pieces may keep: the tolerance, and no more than they have without their correction.

    correction (p,): size of the largest one of a piece, mm. Rounding to steps of step_mm bounds the goal from below.
    """
    out: Floats = np.minimum(1e-3 * tolerance_um, np.maximum(correction, np.sqrt(3.0) * step_mm))
    return out


def chord_budget(goal: Floats, step_mm: float) -> Floats:
    """Part (p,) mm of error goals (p,) mm for chords, after the rounding of their ends to steps of step_mm.

    Where rounding alone leaves more than the goal, finer lines do not help and get all of it.
    """
    rounding = 0.5 * np.sqrt(3.0) * step_mm
    return np.where(rounding >= goal, goal, np.maximum(goal - rounding, 0.1 * goal))


def corrected_pieces(path: Path, track: Track) -> Bools:
    """Pieces (p,) whose tips are known and not given in machine coordinates."""
    return path.known[track.motion] & ~path.machine[track.motion]


def refuse_unsolved(program: Program, track: Track, piece: Ints, target: Floats, status: Ints) -> None:
    """Raises PhysicsError for every source line with a point that could not be solved; target (k, 3) mm."""
    errors: dict[int, PhysicsError] = {}
    for i in np.flatnonzero(status != 0):
        at = _place(program, int(track.motion[piece[i]]))
        if at.line not in errors:
            x, y, z = target[i]
            text = f"{STATUS.get(int(status[i]), 'no solution')} at X{x:.4f} Y{y:.4f} Z{z:.4f} (program frame, mm)"
            errors[at.line] = PhysicsError(RULE_OF_STATUS.get(int(status[i]), "CC301"), text, at=at)
        if len(errors) == MOST_ERRORS:
            break
    raise_all(list(errors.values()))


def _place(program: Program, motion: int) -> Location:
    """Where a motion stands in the text: its first axis word."""
    row = int(program.sites.row[motion])
    words = program.sites.begin[motion, :3]
    words = words[words >= 0]
    column = int(words.min() - program.text.starts[row]) if len(words) else 0
    return program.text.place(row, max(column, 0))


def without_shared_ends(track: Track, piece: Ints, w: Floats) -> tuple[Ints, Floats, Ints]:
    """Points (k,) of a track without the starts of pieces that go on smoothly from the end before, and which stands for each.

    piece, w (n,): points in the order of travel. The third result (n,) counts the points that are left.
    """
    again = np.zeros(len(piece), np.bool_)
    if len(piece):
        here = piece[1:]
        again[1:] = (w[1:] == 0.0) & (w[:-1] == 1.0) & (here == piece[:-1] + 1) & ~(track.jump | track.corner)[here]
    fresh = ~again
    return chosen(piece, fresh), chosen(w, fresh), np.cumsum(fresh) - 1


def travel_of(job: Job, track: Track, piece: Ints, w: Floats) -> Travel:
    """Force of points in the order of travel; their time, with rapids at RAPID_FEED, where effects depend on it, else zero."""
    force, turn, rotation = job.frame.vectors(track.force(piece, w)), track.path.orientation, None
    if turn is not None:
        rotation = platform_rotations(job, turn.form, turn.words(track.motion[piece], track.u(piece, w)))
    if not job.causes:
        none, never = np.zeros(len(piece)), np.zeros(len(piece), np.bool_)
        return Travel(force=force, time=none, cut_min=none, stop=never, rotation=rotation)
    minutes = track.length / _speeds(job, track.path)[track.motion]
    start = track.began_min + np.cumsum(minutes) - minutes
    cut = minutes * track.cutting
    worn = np.cumsum(cut) - cut
    behind = np.concatenate((track.corner[1:], [True]))
    stop = (w == 0.0) & track.corner[piece] | (w == 1.0) & behind[piece]
    time = 60.0 * (start[piece] + w * minutes[piece])
    around = None
    if has_moved_mass(job.real_machine.robot):
        around = _around(track, 60.0 * minutes, piece, time)
    return Travel(
        force=force, time=time, cut_min=worn[piece] + w * cut[piece], stop=stop, around=around, rotation=rotation
    )


def minutes_of(job: Job, path: Path) -> Floats:
    """Minutes (n,) of motions; rapids go at RAPID_FEED."""
    return np.asarray(path_geometry.lengths(path) / _speeds(job, path))


def _speeds(job: Job, path: Path) -> Floats:
    """Feeds (n,) mm/min of motions, RAPID_FEED for rapids and where none is known."""
    feed = job.conditions.feeds(path.feed)
    return np.where((path.kind == RAPID) | ~(feed > 0.0), RAPID_FEED, feed)


def _around(track: Track, seconds: Floats, piece: Ints, time: Floats) -> Floats:
    """Programmed tips (3, n, 3) AROUND_S before, at and after times (n,) s in pieces (n,) of `seconds` (p,) each.

    At the ends of a stretch without corners and changes of feed, those of the nearest inner instant; three times the same
    point in a stretch that is shorter.
    """
    end = np.cumsum(seconds)
    speed = track.length / np.maximum(seconds, 1e-12)
    begins = track.corner | (np.abs(np.diff(speed, prepend=-1.0)) > SAME_SPEED * speed)
    first = np.maximum.accumulate(np.where(begins, np.arange(len(begins)), 0))
    last = np.minimum.accumulate(np.where(np.append(begins[1:], True), np.arange(len(begins)), len(begins))[::-1])[::-1]
    low, high = (end - seconds)[first][piece], end[last][piece]
    step = np.where(high - low < 2.0 * AROUND_S, 0.0, AROUND_S)
    at = np.clip(time, np.minimum(low + step, high), np.maximum(high - step, low))
    tips = []
    for t in (at - step, at, at + step):
        k = np.clip(np.searchsorted(end, t, side="left"), first[piece], last[piece])
        w = np.clip((t - (end - seconds)[k]) / np.maximum(seconds[k], 1e-12), 0.0, 1.0)
        tips.append(track.points(k, w))
    return np.stack(tips)
