"""Compensate a program: which tips must be commanded so that the loaded machine cuts what was programmed.

Read, lay the cutting force along the path, solve the modified target at trial points, divide where the correction
bends, solve again at the division points, write, and put the written program through the full model.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from camcomp.compensation.bands.outcome import Bands, BandTotals
from camcomp.compensation.bands.tip_field import tip_field_of
from camcomp.compensation.program import division
from camcomp.compensation.program.corrected_rows import CorrectedRows, corrected_rows, output_of, times_of
from camcomp.compensation.program.division import Bend, Nodes, begins_of, second_derivative, trial_nodes
from camcomp.compensation.program.judged_points import (
    Division,
    JudgedPoints,
    Seen,
    commanded_travel,
    see,
    see_original,
    whole_pose,
)
from camcomp.compensation.program.line_ends import cut_at, pieces_between, points_inside, trial_spacing
from camcomp.compensation.program.moves import (
    chord_budget,
    corrected_pieces,
    error_goals,
    refuse_unsolved,
    without_shared_ends,
)
from camcomp.compensation.program.orienting import MOST_TILT_RAD, Orienting, refuse_unfollowed
from camcomp.compensation.program.play import cut_for_drives, load_turns, turns_warning
from camcomp.compensation.program.posture import check_posture
from camcomp.compensation.program.programmed import Programmed
from camcomp.compensation.program.result import Interpolation
from camcomp.compensation.program.uncertainty import shares_of, tip_moves
from camcomp.compensation.program.under_control import UnderControl, rests, stays_apart
from camcomp.gcode.output import Part, Rewritten
from camcomp.gcode.program import Program
from camcomp.gcode.rewrite import rewrite
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, RAPID, Bools, Floats, Ints
from camcomp.ground.progress import part as part_of_work
from camcomp.ground.records import dataclass, replace
from camcomp.ground.vectors import chosen, largest, largest_of_groups, sizes
from camcomp.model.cutting.engaged import Engaged
from camcomp.model.cutting.spindle import cut_without_spindle
from camcomp.model.cutting.track import Track, lay_track
from camcomp.model.job import Job
from camcomp.model.motion.response import acting_force
from camcomp.model.signal_path import has_memory
from camcomp.model.statics.target import Correction

MAX_ROUNDS, ARC_ROUNDS = 6, 4
STUCK = 0.95  # of the miss is left by a finer division that is no use, as where an arc passes the vertical
WITH_SHARES = 0.7  # of the tolerance at the points looked at: where the share bends, more is missed between them


@dataclass(frozen=True, eq=False, kw_only=True)
class Compensated:
    """The corrected program and everything that is known about it; points (N, ...) are its end points."""

    program: Program
    written: Rewritten
    rows: CorrectedRows
    s: Floats  # (N,) mm programmed path length
    t: Floats  # (N,) s
    nominal: Floats  # (N, m) inverse kinematics of the programmed tip
    state: Correction  # loaded machine at the written end points
    force: Floats  # (N, 3) N on the tool that acts there, machine frame, effects on it included
    uncorrected: Floats  # (N, 3) loaded tip of the original program, program frame
    before: Floats  # errors (k, 3) mm of the original program along feed motions
    after: Floats  # errors (k, 3) mm of the corrected program along feed motions
    control: UnderControl  # what the control makes of both programs
    judged: Ints  # (k,) end point to which the move leads on which an error was found
    iterations: int
    method: str
    without_spindle: Ints  # source lines that cut while the spindle stands
    warnings: list[str]  # of what the correction has met
    feeds: int  # corrected feed motions
    moved: bool  # any of them leads elsewhere than programmed
    engaged: Engaged | None  # what the tool meets along the path
    bands: Bands | None = None  # None: every number of the config is exact
    missed: Floats  # (k, 3) mm of `after` without what a policy leaves on purpose
    orienting: Orienting | None = None  # how the program states the orientation of the tool; None: it does not
    tilt_after: Floats | None = None  # (k,) rad of the loaded platform where the tip is judged
    programmed_words: Floats | None = None  # (N, 3) of the program's orientation at every end point; None: it has none
    interpolated: Interpolation | None = None  # None: every point was solved exactly

    @property
    def lines(self) -> Ints:
        """Source line (N,) of every end point."""
        return self.program.path.line[self.rows.motion]


def compensate(
    program: Program, job: Job, *, method: str, tolerance_um: float, version: str, part: Part | None = None,
    arcs: bool | None = None, engaged: Engaged | None = None, began_min: float = 0.0,
) -> Compensated:  # fmt: skip
    """The corrected program. Raises PhysicsError where the machine cannot do what is asked.

    arcs: programmed arcs come out as arcs where those are fewer than lines; None asks the machine file. Where that does
    not say either they do when the control, in a path mode that is stated, is then faster or nearer to the path.

    part: the motions to be corrected and written, when the program is a part of a longer one. The others are only there
    because their neighbours depend on them: they are not divided, and their errors do not count. engaged: what the tool
    meets along the path, when the program has been followed through its stock before. began_min: minutes before the part.
    """
    asked = job.config.compensation.arcs if arcs is None else arcs
    correction = _Correction(
        program=program, job=job, method=method, tolerance_um=tolerance_um, version=version, part=part,
        engaged=engaged or job.engaged(program), began_min=began_min,
    )  # fmt: skip
    found = correction.done(arcs=bool(asked))
    own = slice(None) if part is None else slice(part.first, part.last)
    able = bool((program.path.kind[own] == ARC).any()) and not job.causes
    if asked is None and able and (found.control.leaves_room(tolerance_um) or found.control.apart):
        other = correction.done(arcs=True)
        as_good = found.control.apart and not other.control.apart  # in the program's own mode
        as_good = as_good and not found.control.better_than(other.control, tolerance_um)
        if as_good or other.control.better_than(found.control, tolerance_um):
            return other
    return found


@dataclass(eq=False, kw_only=True)
class _Correction:
    """One program to be corrected: its track of pieces (p,), and the trial points from which they are divided."""

    program: Program
    job: Job
    method: str
    tolerance_um: float
    version: str
    part: Part | None
    engaged: Engaged | None
    began_min: float

    def __post_init__(self) -> None:
        program, job, spacing = self.program, self.job, trial_spacing(self.job)
        self.step = program.step_mm(job.config.control.resolution_mm)
        base = replace(lay_track(program.path, job.conditions, self.engaged), began_min=self.began_min)
        self.orienting = Orienting.of(program, job)
        if self.orienting is not None:
            refuse_unfollowed(job, self.method, self.part)
        self.turns = load_turns(job, base)
        turned = cut_at(base, [(i, at) for i, *ends in self.turns for at in ends])
        track, turning = cut_for_drives(job, turned)
        self.shares = shares_of(job, base)
        if self.shares is not None:
            track, of = self.shares.divided(self.shares.with_jumps(track))
            turning = turning[of]
        self.asked = Programmed(program, job, track, self.shares, self.orienting)
        self.track, self.pushed = track, pieces_between(base, track, self.turns)
        self.corrected = corrected_pieces(program.path, track)
        self.feeding = self.corrected & (program.path.kind[track.motion] != RAPID)
        if self.part is not None:
            self.feeding &= (track.motion >= self.part.first) & (track.motion < self.part.last)
        self.turning, self.spacing = turning | self.pushed, spacing
        simple = self.shares is None and self.orienting is None
        self.by_ends = (track.angle == 0.0) & (track.length <= spacing) & simple
        self._try()

    def _try(self) -> None:
        """Solve trial points `spacing` mm apart: how the commanded path bends, and which error a piece may keep.

        Short lines are tried at their ends; those whose middle then shows a bend are tried again.
        """
        track = self.track
        inner = self.feeding & ~self.turning & (track.length > 0.0) & ~self.by_ends
        self.trial = trial = trial_nodes(track.length, track.angle, inner, self.spacing)
        with part_of_work(0.0, 0.4, points=True):
            self.aimed = self._aim(trial)
        curve = self.aimed.commanded
        correction = curve - track.points(trial.piece, trial.w)
        self.kept = _kept(track, trial, correction, 0.5 * self.step)
        if self.orienting is not None:
            length = self.orienting.length(1e-3 * self.tolerance_um)
            curve = np.column_stack((curve, self.aimed.words * length))
            self.kept &= self.orienting.kept(track, trial, self.aimed.words)
        self.second = second_derivative(trial, curve)
        most = largest_of_groups(sizes(correction), trial.piece, len(track.motion))
        self.goal = error_goals(self.tolerance_um, self.step, most)
        self.budget = chord_budget(self.goal, self.step)
        if self.shares is not None:
            self.goal *= WITH_SHARES
        self.whole = self.kept | self.turning  # pieces that are not divided

    def _aim(self, nodes: Nodes) -> _Aimed:
        """Modified targets at nodes, program frame; nodes of uncorrected pieces stay as programmed."""
        asked, track, on = self.asked, self.track, np.flatnonzero(self.corrected[nodes.piece])
        piece, w, of = nodes.piece[on], nodes.w[on], np.arange(len(on))
        if asked.orienting is None:
            piece, w, of = without_shared_ends(track, piece, w)
        points = of
        if self.job.causes:
            begin = begins_of(piece, w)
            way = (w - begin) * track.length[piece]
            rapid = (track.path.kind[track.motion[piece]] == RAPID) & (way > 0.0)
            node, share = points_inside(self.job, rapid, way)
            between, at = piece[node], begin[node] + share * (w - begin)[node]
            order = np.lexsort((np.concatenate((w, at)), np.concatenate((piece, between))))
            points = np.argsort(order, kind="stable")[: len(piece)][of]
            piece, w = np.concatenate((piece, between))[order], np.concatenate((w, at))[order]
        result, turned = asked.aim(piece, w, method=self.method, tips_only=True)
        words = asked.words(nodes.piece, nodes.w)
        if asked.orienting is not None:
            words[on] = turned[points]
        status = result.status
        if self.part is not None:  # the others are refused as parts of their own
            own = (track.motion[piece] >= self.part.first) & (track.motion[piece] < self.part.last)
            status = np.where(own, status, 0)
        if status.any():
            refuse_unsolved(self.program, track, piece, track.points(piece, w), status)
        aimed = out = result.commanded.take(points, axis=0)
        if len(on) < len(nodes.w):
            out = track.points(nodes.piece, nodes.w)
            out[on] = aimed
        return _Aimed(asked.taken(nodes.piece, nodes.w, out), int(result.iterations[points].max(initial=0)), words)

    def _aim_at_others(self, nodes: Nodes) -> _Aimed:
        """`_aim`; the targets of trial points are known already where drives have no memory."""
        known = self.aimed
        at, fresh = nodes.among(self.trial)
        if not len(fresh) and len(nodes.w) == len(self.trial.w):
            return known
        if has_memory(self.job.causes) or self.orienting is not None:
            return self._aim(nodes)
        commanded, iterations = known.commanded[at], known.iterations
        if len(fresh):
            found = self._aim(Nodes(nodes.piece[fresh], nodes.w[fresh], nodes.first))
            commanded[fresh], iterations = found.commanded, max(iterations, found.iterations)
        return _Aimed(commanded, iterations, np.zeros_like(commanded))

    # --- division ------------------------------------------------------------------------------------------------

    def _divided(self, arcs: bool) -> Division:
        """Divide finer and finer, until the written program keeps its goals or a finer division is no use."""
        bend, tolerance = self._bend(arcs)
        last, last_count = np.full(len(tolerance), np.inf), np.zeros(len(tolerance), np.int64)
        round_ = 0
        while True:
            nodes, shift = bend.divided(self.trial, tolerance)
            if (gone := bend.pointless(nodes)).any():
                bend.use &= ~gone
                tolerance[gone] = self.budget[gone]
                nodes, shift = bend.divided(self.trial, tolerance)
            with part_of_work(1.0 - 0.6 * 0.5**round_, 1.0 - 0.35 * 0.5**round_, points=True):
                commanded, centre, words = self._bent(nodes, shift, bend)
            found = self._written(nodes, commanded, centre, words)
            missed = (found.worst > self.goal) & ~self.whole
            finer = tolerance * np.clip(0.9 * self.goal / np.maximum(found.worst, 1e-12), 0.3, 0.9)
            sagging = (found.points.sags(found.after.error, len(missed)) > self.budget) & ~self.whole
            if (unseen := self.by_ends & (missed | sagging)).any():
                self.by_ends &= ~unseen
                self._try()
                bend, tolerance = self._bend(arcs)
                tolerance = np.where(unseen & ~sagging, np.minimum(finer, tolerance), tolerance)
                continue
            count = np.diff(nodes.first)
            stuck = missed & (found.worst >= STUCK * last) & (count > last_count)
            straighten = missed & bend.use & (stuck | (round_ >= ARC_ROUNDS - 1))
            missed &= ~stuck & ~straighten
            round_ += 1
            if not (missed | straighten).any() or round_ == MAX_ROUNDS:
                break
            last, last_count = np.where(straighten, np.inf, found.worst), count
            bend.use &= ~straighten
            tolerance[straighten] = self.budget[straighten]
            tolerance = np.where(missed, finer, tolerance)
        return found

    def _bend(self, arcs: bool) -> tuple[Bend, Floats]:
        """What pieces are divided for, and chords' tolerances (p,) mm."""
        tolerance, step = self.budget.copy(), self.step
        tolerance[self.whole] = np.inf
        able = self.feeding & ~self.kept & (arcs and not self.job.causes)  # no arc follows waves that drives leave over
        bend = Bend(
            track=self.track, trial=self.trial, commanded=self.aimed.commanded, second=self.second,
            tolerance=tolerance, able=able,
        )  # fmt: skip
        rounded = np.maximum(self.budget - np.sqrt(0.5) * step, 0.1 * self.budget)  # the centre is rounded, too
        tolerance[bend.use] = rounded[bend.use]
        return bend, tolerance

    def _bent(self, nodes: Nodes, shift: Floats, bend: Bend) -> tuple[Floats, Floats, Floats | None]:
        """Commanded tips (k, 3) at nodes, centres (k, 3) of the moves that lead there as arcs, NaN for lines, and the words
        (k, 3) of the orientation there. Turns off what cannot bend.
        """
        track = self.track
        both, middle = division.middles(nodes, bend.use)
        aimed = self._aim_at_others(both)
        solved = aimed.commanded
        commanded = solved.compress(~middle, axis=0) + shift[:, :3]
        centre = np.full((len(commanded), 3), np.nan)
        to = np.flatnonzero((np.diff(nodes.piece, prepend=-1) == 0) & bend.use[nodes.piece])
        if len(to):
            motion = track.motion[nodes.piece[to]]
            centre[to], wrong = division.through(
                start=commanded[to - 1], middle=solved[middle], end=commanded[to], axis=track.path.axis[motion],
                way=track.path.angle[motion], flat=division.FLATTEST * self.step,
            )  # fmt: skip
            bend.use[nodes.piece[to[wrong]]] = False
        if self.orienting is None:
            return commanded, centre, None
        turned = shift[:, 3:] / self.orienting.length(1e-3 * self.tolerance_um)
        return commanded, centre, aimed.words[~middle] + turned

    def _written(self, nodes: Nodes, commanded: Floats, centre: Floats, words: Floats | None) -> Division:
        """The program written with commanded tips (k, 3) at nodes, and seen by the full model."""
        asked, part = self.asked, self.part
        rows = corrected_rows(
            asked, nodes, commanded=commanded, kept=self.kept, centre=centre, begins=part is None or part.first == 0, words=words
        )  # fmt: skip
        written = self._rewritten(rows)
        points = JudgedPoints(asked, rows, self.feeding & ~self.pushed)
        curves = rows.curves(self.program.path, written.end, written.centre)
        told = path_geometry.points(curves, points.row, points.fraction)
        after = see(asked, points, told, written.words)
        missed = asked.missed(after.error, points.piece, points.w, points.travel, points.before)
        size = np.where(after.status == 0, sizes(missed), np.inf)
        if after.tilt is not None:
            size = np.maximum(size, np.nan_to_num(after.tilt) * self.goal[points.piece] / MOST_TILT_RAD)
        return Division(
            rows=rows, written=written, points=points, commanded=told, after=after, missed=missed,
            worst=largest_of_groups(chosen(size, points.judged), chosen(points.piece, points.judged), len(self.goal)),
        )  # fmt: skip

    def _rewritten(self, rows: CorrectedRows, rest: Bools | None = None, apart: Bools | None = None) -> Rewritten:
        return rewrite(
            self.program, output_of(rows, rest, apart), part=self.part, version=self.version,
            resolution_mm=self.job.config.control.resolution_mm, model=self.job.fingerprint,
        )  # fmt: skip

    # --- the finished program ------------------------------------------------------------------------------------

    def done(self, arcs: bool) -> Compensated:
        """The corrected program, its arcs as arcs or as lines."""
        program, job, track = self.program, self.job, self.track
        found = self._divided(arcs and self.orienting is None)  # a circle of the tip does not turn the tool as needed
        rows, points, after, judged = found.rows, found.points, found.after, found.points.judged
        with part_of_work(0.8, 1.0, points=True):
            before = see_original(job, points)
        for seen in (after, before):
            bad = np.flatnonzero(judged & (seen.status != 0))
            refuse_unsolved(program, track, points.piece[bad], points.target[bad], seen.status[bad])
        still = cut_without_spindle(track)
        if len(still):
            still = np.intersect1d(still, program.path.line[track.motion[self.feeding]])
        written, control = self._controlled(found)
        line, nominal = program.path.line[rows.motion], before.state.rho_nominal
        warnings = turns_warning(self.turns) + check_posture(
            program, job, line, job.frame.to_machine(rows.target), nominal
        )
        state = after.state
        if self.method != "linear" and rows.words is None:  # words of orientation say what the control makes of them
            state = whole_pose(job, points, found.commanded, rows.corrected, state)
        s = track.s0[rows.piece] + rows.w * track.length[rows.piece]
        return Compensated(
            program=program, written=written, rows=rows, s=s, t=times_of(job, program, rows, s), nominal=nominal, state=state,
            force=acting_force(job, state.rho, points.travel, points.end), uncorrected=before.tip,
            before=chosen(before.error, judged), control=control, judged=control.points.move, missed=control.points.error,
            after=control.points.error if found.missed is after.error else chosen(after.error, judged),
            iterations=self.aimed.iterations, method=self.method, without_spindle=still, warnings=warnings,
            feeds=int(np.count_nonzero(np.diff(track.motion[self.feeding], prepend=-1))),
            moved=not self.kept[self.feeding].all(), engaged=track.engaged,
            bands=self._bands(found, before, written),
            orienting=self.orienting, tilt_after=None if after.tilt is None else chosen(after.tilt, judged),
            programmed_words=None if self.orienting is None else self.asked.words(rows.piece, rows.w),
        )  # fmt: skip

    def _controlled(self, found: Division) -> tuple[Rewritten, UnderControl]:
        """The program with the stops and path modes that its controller needs, and what that makes of it."""
        rows, rest = found.rows, rests(self.program, found.rows, self.tolerance_um, self.part)
        written = self._rewritten(rows, rest) if rest.any() else found.written
        planned = partial(
            UnderControl, self.asked, replace(found, written=written), rest=rest, tolerance_um=self.tolerance_um
        )
        control = planned()
        apart = stays_apart(self.program, rows, self.part)
        if apart.any() and control.stated and control.account.errors.most_um > self.tolerance_um:
            other = planned(apart=apart)
            if other.nearer_than(control):
                return self._rewritten(rows, rest, apart), other
        return written, control

    def _bands(self, found: Division, before: Seen, written: Rewritten) -> Bands | None:
        """Bands of the end points; None where every number of the config is exact."""
        job, rows, points = self.job, found.rows, found.points
        if not job.config.uncertain:
            return None
        at = np.arange(len(points.row)) if job.causes else np.flatnonzero(points.end)
        free = (rows.joining & (rows.w > 0.0))[points.row]
        travel = commanded_travel(points, self.orienting, written.words)
        moves = tip_moves(
            job, self.track, points.piece[at], points.w[at], commanded=found.commanded[at], travel=travel.take(at),
            base=(found.after.error + points.target)[at], free=free[at], before=points.before,
        )  # fmt: skip
        ends, counted = moves.take(np.flatnonzero(points.end[at])), np.flatnonzero(points.judged)
        share = np.ones(len(rows.w))
        if self.shares is not None:
            share = self.shares.of_ends(self.track, rows.piece, rows.w, rows.joining)
        totals, row = BandTotals(tip_field_of(job).inputs), points.row[counted]
        totals.add(found.after.error[counted], ends.take(row), share[row])
        return Bands(
            before=before.error[points.end], after=found.after.error[points.end], moves=ends, share=share,
            known=rows.corrected, totals=totals,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Aimed:
    commanded: Floats  # (k, 3) program frame
    iterations: int
    words: Floats  # (k, 3) of the orientation, zero where the program states none


def _kept(track: Track, nodes: Nodes, correction: Floats, half: float) -> Bools:
    """Pieces (p,) that stay as programmed, arcs as arcs: whole motions whose correction (k, 3) would be rounded away."""
    most = largest_of_groups(largest(correction), nodes.piece, len(track.motion))
    out: Bools = (most <= half) & (np.bincount(track.motion)[track.motion] == 1)
    return out
