"""Where an axis passes the rows of its error table, and when something begins or ends that acts for a while.

There the correction has a corner, and so the line has to end.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from camcomp.compensation.program.chords import trial_nodes
from camcomp.compensation.program.moves import corrected_pieces, travel_of
from camcomp.ground.datatypes import Bools, Floats
from camcomp.model.cutting.track import Track
from camcomp.model.effect import Cause
from camcomp.model.error_table.table import ErrorTable
from camcomp.model.job import Job
from camcomp.model.statics.solve import inverse

_LEAST = 1e-6  # of a piece: what lies nearer to its ends is an end


def cut_at_knots(job: Job, track: Track, spacing: float) -> Track:
    """The track cut where an axis with an error table passes a row of it, and at the instants that effects name.

    spacing: distance of the points, mm, at which the axes are looked at; between them they move straight.
    """
    tables = [
        (cause, cause.values["table"]) for cause in job.causes if isinstance(cause.values.get("table"), ErrorTable)
    ]
    corrected = corrected_pieces(track.path, track)
    instants = [knot for cause in job.causes for knot in _instants(cause)]
    if not (tables or instants) or not corrected.any():
        return track
    trial = trial_nodes(track.length, track.angle, corrected & (track.length > 0.0), spacing)
    tip = job.frame.to_machine(track.points(trial.piece, trial.w))
    machine = job.real_machine
    reference = tip - machine.nominal.held_rotation @ machine.nominal.tool
    actuators = inverse(machine, tip)
    on = corrected[trial.piece]
    within = on[:-1] & on[1:] & (trial.piece[1:] == trial.piece[:-1])
    passed: list[tuple[Floats, Iterable[float]]] = []
    for cause, table in tables:
        named = np.flatnonzero(cause.which(machine.actuators))
        x = actuators[:, named[0]] if len(named) else reference[:, "XYZ".index(str(cause.target)[2])]
        passed.append((x, table.position.tolist()))
    if instants:
        passed.append((travel_of(job, track, trial.piece, trial.w).time, instants))
    cuts: set[tuple[int, float]] = set()
    for x, knots in passed:
        for knot in knots:
            row, share = _crossings(x - knot, within)
            w = trial.w[row] + share * (trial.w[row + 1] - trial.w[row])
            inner = (w > _LEAST) & (w < 1.0 - _LEAST)
            cuts.update(zip(trial.piece[row][inner].tolist(), w[inner].tolist(), strict=True))
    if not cuts:
        return track
    of, w = (np.array(each) for each in zip(*sorted(cuts), strict=True))
    apart = np.append(True, (np.diff(of) > 0) | (np.diff(w) > _LEAST))
    return track.cut(of[apart], w[apart])


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
