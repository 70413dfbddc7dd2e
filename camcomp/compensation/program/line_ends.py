"""Places inside the pieces of a track at which a line has to end: points at which to look for them, and the track cut there.

The correction has a corner where an axis passes a row of its error table, and when something begins or ends that acts for
a while.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from camcomp.compensation.program.division import COARSE_MM, trial_nodes
from camcomp.compensation.program.moves import WITHIN_RAPID, corrected_pieces, travel_of
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints
from camcomp.model.cutting.track import Track
from camcomp.model.effect import Cause
from camcomp.model.error_table.table import ErrorTable
from camcomp.model.job import Job
from camcomp.model.signal_path import acting
from camcomp.model.statics.solve import inverse

FINE_MM = 0.5  # distance of trial points on straight lines with effects
SHARE_OF_WAVE = 0.15  # between them, at most: no row of points meets a wave at its zeros alone
LOOP_MM = 1.0  # between points at which set-points of long lines are looked at
LEADING_MM = 5e-4  # of a line that takes up the lag of a loop beside a stop; the tip misses half of that
LEAST = 1e-6  # of a piece: places nearer to each other or to its ends are one

Place = tuple[int, float]  # piece, fraction of it
Span = tuple[int, float, float]  # piece, fractions of it at begin and end


def trial_spacing(job: Job) -> float:
    """Distance of trial points, mm: a screw's error has waves of a few mm, the scale of an encoder shorter ones."""
    waves = [SHARE_OF_WAVE * each for each in (cause.values.get("pitch_mm", 0.0) for cause in job.causes) if each > 0.0]
    return min([FINE_MM, *waves]) if job.causes else COARSE_MM


def points_along(track: Track, spacing: float = COARSE_MM) -> tuple[Ints, Floats]:
    """Pieces (k,) and fractions (k,) of points at most `spacing` mm apart on corrected pieces, in the order of travel."""
    corrected = corrected_pieces(track.path, track)
    nodes = trial_nodes(track.length, track.angle, corrected & (track.length > 0.0), spacing)
    on = corrected[nodes.piece]
    return nodes.piece[on], nodes.w[on]


def points_inside(job: Job, rapid: Bools, way: Floats) -> tuple[Ints, Floats]:
    """Moves (k,) and fractions (k,), never a half, of points inside moves that matter to those at their ends, in the order of travel.

    Drives remember their turns within rapids (p,); control loops are late by the speed at which actuators arrive, which changes along
    a straight `way` (p,) mm.
    """
    steps = np.where(rapid & bool(job.causes), len(WITHIN_RAPID) + 1, 1)
    if is_late(job):
        steps = np.where(rapid, steps, 2 * np.round(0.5 * way / LOOP_MM).astype(np.int64) + 1)
    move = np.repeat(np.arange(len(steps)), steps - 1)
    k = np.arange(len(move)) - np.repeat(np.cumsum(steps - 1) - (steps - 1), steps - 1)
    return move, (k + 1.0) / steps[move]


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


def cut_at_knots(job: Job, track: Track, spacing: float) -> Track:
    """The track cut where an axis with an error table passes a row of it, and at the instants that effects name.

    spacing: distance of the points, mm, at which the axes are looked at; between them they move straight.
    """
    tables = [
        (cause, cause.values["table"]) for cause in job.causes if isinstance(cause.values.get("table"), ErrorTable)
    ]
    instants = [knot for cause in job.causes for knot in _instants(cause)]
    if not (tables or instants):
        return track
    piece, w = points_along(track, spacing)
    tip = job.frame.to_machine(track.points(piece, w))
    machine = job.real_machine
    reference = tip - machine.nominal.held_rotation @ machine.nominal.tool
    actuators = inverse(machine, tip)
    within = piece[1:] == piece[:-1]
    passed: list[tuple[Floats, Iterable[float]]] = []
    for cause, table in tables:
        named = np.flatnonzero(cause.which(machine.actuators))
        x = actuators[:, named[0]] if len(named) else reference[:, "XYZ".index(str(cause.target)[2])]
        passed.append((x, table.position.tolist()))
    if instants:
        passed.append((travel_of(job, track, piece, w).time, instants))
    cuts: set[Place] = set()
    for x, knots in passed:
        for knot in knots:
            row, share = _crossings(x - knot, within)
            cuts.update(zip(piece[row].tolist(), (w[row] + share * np.diff(w)[row]).tolist(), strict=True))
    return cut_at(track, cuts)


def is_late(job: Job) -> bool:
    """Whether control loops act on the set-points."""
    return bool(acting(job.causes, "control"))


def cut_at_stops(job: Job, track: Track) -> Track:
    """The track with a short piece of its own behind and in front of every stop in feed lines, where control loops are late.

    Behind a stop the commanded tip leads the programmed one at once, in front of it no longer.
    """
    loops = acting(job.causes, "control")
    if not (loops and all(getattr(cause.effect, "STAYS_BEHIND", False) for cause in loops)):
        return track
    real = np.flatnonzero(track.length > 0.0)
    begins = np.diff(np.cumsum(track.corner)[real], prepend=0) > 0
    feed = corrected_pieces(track.path, track) & (track.path.kind[track.motion] != RAPID)
    able = (feed & (track.length > 4.0 * LEADING_MM))[real]
    near = np.maximum(LEADING_MM / np.maximum(track.length, LEADING_MM), 2.0 * LEAST)
    behind, before = real[begins & able], real[np.append(begins[1:], True) & able]
    piece, w = np.concatenate((behind, before)), np.concatenate((near[behind], 1.0 - near[before]))
    return cut_at(track, zip(piece.tolist(), w.tolist(), strict=True))


def _instants(cause: Cause) -> list[float]:
    """Times, s, of a temporary effect: begin, end of its rise, begin of its fall, end."""
    ends = [cause.values[p.name] for p in cause.effect.PARAMETERS if p.placed]
    rise = getattr(cause.effect, "RISE_S", 0.0)
    return [] if len(ends) != 2 else [ends[0], ends[0] + rise, ends[1] - rise, ends[1]]


def _crossings(x: Floats, within: Bools) -> tuple[np.ndarray, Floats]:
    """Rows after which x (n,) passes zero before the next row, and at which share of the way."""
    a, b = x[:-1], x[1:]
    row = np.flatnonzero(within & ((a < 0.0) != (b < 0.0)) & np.isfinite(a) & np.isfinite(b))
    return row, a[row] / (a[row] - b[row])
