"""Tip errors before and after compensation, by the full model, at the judged points of a program."""

from __future__ import annotations

from typing import Any

import numpy as np

from camcomp.compensation.program.corrected_rows import CorrectedRows
from camcomp.compensation.program.division import begins_of
from camcomp.compensation.program.line_ends import points_inside
from camcomp.compensation.program.orienting import Orienting
from camcomp.compensation.program.programmed import Programmed
from camcomp.gcode.output import Rewritten
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints
from camcomp.ground.orientation import UPRIGHT
from camcomp.ground.records import dataclass, replace
from camcomp.ground.vectors import largest_of_groups, sizes
from camcomp.model.job import Job
from camcomp.model.motion.response import aim_pose, respond
from camcomp.model.motion.travel import Travel
from camcomp.model.statics.target import Correction


class JudgedPoints:
    """Points (k,) at which a corrected program is looked at, in the order of travel.

    End points (N,) of its rows, and between them the middles of lines and the quarters of arcs.
    """

    def __init__(self, asked: Programmed, rows: CorrectedRows, feeding: Bools) -> None:
        """Feeding (p,): pieces on which points between end points are looked at."""
        job, track, n = asked.job, asked.track, len(rows.piece)
        cut = feeding[rows.piece] & ~rows.joining
        start = begins_of(rows.piece, rows.w)
        inner = np.flatnonzero(cut & (track.length[rows.piece] > 0.0))
        bent = inner[rows.bent[inner]]
        way = np.where(cut, (rows.w - start) * track.length[rows.piece], 0.0)
        many, more = points_inside(job, (rows.kind == RAPID) & rows.corrected, way)
        row = np.concatenate((np.arange(n), inner, bent, bent, many))
        fraction = np.concatenate((np.repeat([1.0, 0.5, 0.25, 0.75], [n, len(inner), len(bent), len(bent)]), more))
        order = np.argsort(row + 0.5 * fraction, kind="stable")
        self.row = row = row[order]  # end point that the point belongs to
        self.fraction = fraction = fraction[order]  # of the move to it, 1 at its end
        self.end = end = fraction == 1.0
        self.piece = piece = rows.piece[row]
        self.w = start[row] + fraction * (rows.w - start)[row]
        self.w[end] = rows.w
        self.target, self.travel = track.points(piece, self.w), asked.travel(piece, self.w)
        self.travel.force[end] = job.frame.vectors(rows.force)  # joining lines know better
        self.judged = cut[row]  # counted in before and after: feed motions, no joining lines
        self.before = track.path.start[0] if n and track.path.known[0] else None  # (3,) where the first move starts
        self.near: Any = None  # response of a machine without effects that is interpolated, around the targets
        answers = job.real_machine.answers
        if answers is not None and not job.causes and self.travel.rotation is None:
            self.near = answers.near(job.frame.to_machine(self.target), self.travel.force, end)

    def sags(self, error: Floats, pieces: int) -> Floats:
        """How far (mm) in each piece (pieces,) errors (k, 3) at the middles of lines lie off the mean of those at their ends."""
        at = np.flatnonzero((self.fraction == 0.5) & self.judged & (self.row > 0))
        end, row = np.flatnonzero(self.end), self.row[at]
        middle, before, behind = (error.take(each, axis=0) for each in (at, end[row - 1], end[row]))
        sag = sizes(middle - 0.5 * (before + behind))
        return largest_of_groups(sag, self.piece[at], pieces)


@dataclass(frozen=True, eq=False)
class Seen:
    """A program put through the full model: errors (k, 3) mm at the points, tips (N, 3) and states at the end points.

    status (k,): 0 where the machine could be solved; the errors of other points are NaN.
    """

    error: Floats
    status: Ints
    tip: Floats
    state: Correction
    tilt: Floats | None = None  # (k,) rad of the loaded platform against the programmed orientation, where looked at


@dataclass(frozen=True, eq=False, kw_only=True)
class Division:
    """Pieces (p,) divided once, written, and put through the full model at judged points (k,)."""

    rows: CorrectedRows
    written: Rewritten
    points: JudgedPoints
    commanded: Floats  # (k, 3) mm, of the written program
    after: Seen
    missed: Floats  # (k, 3) mm of the error without what a policy leaves on purpose
    worst: Floats  # (p,) mm, largest of these


def see(asked: Programmed, points: JudgedPoints, told: Floats, words: Floats | None = None) -> Seen:
    """The loaded machine at commanded points (k, 3) mm, program frame; words (N, 3): of the orientation at end points."""
    job, orienting = asked.job, asked.orienting
    if points.near is not None:  # of machines that do not turn the tool
        tip, state = points.near.response(job.frame.to_machine(told))
        tip = job.frame.to_program(tip)
        return Seen(tip - points.target, points.near.status, tip.compress(points.end, axis=0), state)
    travel, tilt = commanded_travel(points, orienting, words), None
    masses_at = points.target if job.causes or words is not None else None  # masses move with the target
    tip, state = respond(job, told, travel, masses_at, before=points.before)
    if orienting is not None and words is not None and travel.rotation is not None:
        tilt = orienting.tilt(travel.rotation, state, orienting.requested(points.travel))
    return _seen(points, tip, state, tilt)


def commanded_travel(points: JudgedPoints, orienting: Orienting | None, words: Floats | None) -> Travel:
    """The travel with the orientation that words (N, 3) of the end points command; None: as programmed."""
    if orienting is None or words is None:
        return points.travel
    before = np.array(UPRIGHT[orienting.form])  # the first move begins outside of the judged points
    return orienting.told(points.travel, orienting.along(words, before, points.row, points.fraction))


def _seen(points: JudgedPoints, tip: Floats, state: Correction, tilt: Floats | None = None) -> Seen:
    return Seen(tip - points.target, state.status, tip.compress(points.end, axis=0), state.take(points.end), tilt)


def see_original(job: Job, points: JudgedPoints) -> Seen:
    """The original program through the full model, at the same points."""
    if points.near is not None:
        tip = job.frame.to_program(points.near.target + points.near.unloaded)
        ends = tip.compress(points.end, axis=0)
        return Seen(tip - points.target, points.near.status, ends, points.near.programmed())
    tip, state = respond(job, points.target, points.travel, before=points.before, tips_only=True)
    return _seen(points, tip, state)


def whole_pose(job: Job, points: JudgedPoints, commanded: Floats, on: Bools, state: Correction) -> Correction:
    """The state with joint commands that bring tip and orientation to the target, for machines with six actuators.

    Words X Y Z can carry the correction of the tip only, and leave the platform tilted under load; the joint table can
    carry both. Set-points go straight between the rows of the table, so only end points of corrected feed moves are aimed.
    commanded (k, 3) mm: tips of the written program at the points, program frame; on (N,): end points to correct. The
    tilt of the state stays that of the written program.
    """
    if len(job.machine.actuators) != 6 or not on.any():
        return state
    on = on[points.row]
    taken = np.flatnonzero(points.end | ~points.judged | ~on)
    row, on, end = points.row[taken], on[taken], points.end[taken]
    exact = aim_pose(
        job, commanded[taken], points.target[taken], points.travel.take(taken), on, before=points.before
    )  # fmt: skip
    solved = np.flatnonzero((exact.status == 0) & on & end)
    rho, drive = state.rho.copy(), state.drive.copy()
    rho[row[solved]], drive[row[solved]] = exact.rho[solved], exact.drive[solved]
    return replace(state, rho=rho, drive=drive)
