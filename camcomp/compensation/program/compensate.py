"""Compensate a program: which tips must be commanded so that the loaded machine cuts what was programmed.

Read, lay the cutting force along the path, solve the modified target at trial points, divide where the correction
bends, solve again at the division points, write, and put the written program through the full model.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from camcomp.compensation.bands.outcome import Bands
from camcomp.compensation.program import arcs_out
from camcomp.compensation.program.arcs_out import Arcs, Bend
from camcomp.compensation.program.chords import Nodes, second_derivative, trial_nodes
from camcomp.compensation.program.corrected_rows import CorrectedRows, corrected_rows, output_of
from camcomp.compensation.program.judged_points import (
    JudgedPoints,
    Seen,
    commanded_travel,
    judged_points,
    see,
    see_original,
    whole_pose,
)
from camcomp.compensation.program.load_turns import load_turns
from camcomp.compensation.program.moves import (
    WITHIN_RAPID,
    chord_budget,
    corrected_pieces,
    error_goals,
    refuse_unsolved,
    travel_of,
)
from camcomp.compensation.program.orienting import MOST_TILT_RAD, Orienting, refuse_unfollowed
from camcomp.compensation.program.policy import Shares, shares_of
from camcomp.compensation.program.posture import check_posture
from camcomp.compensation.program.program_bands import bands_of
from camcomp.compensation.program.result import Interpolation, error_size, interpolation_failed, worse_than_before
from camcomp.compensation.program.reversals import cut_at_reversals
from camcomp.compensation.program.table_knots import cut_at_knots
from camcomp.compensation.program.under_control import (
    UnderControl,
    rests,
    stays_apart,
    under_control,
)
from camcomp.gcode.output import Part, Rewritten
from camcomp.gcode.program import Program
from camcomp.gcode.rewrite import rewrite
from camcomp.gcode.uncorrected import below_step_warning
from camcomp.ground.datatypes import ARC, RAPID, Bools, Floats, Ints
from camcomp.ground.orientation import UPRIGHT
from camcomp.ground.progress import part as part_of_work
from camcomp.ground.source_lines import named_lines
from camcomp.model.cutting.assumed import ForceDoubts
from camcomp.model.cutting.engaged import Engaged
from camcomp.model.cutting.spindle import cut_without_spindle, spindle_warning
from camcomp.model.cutting.track import Track, lay_track
from camcomp.model.job import Job
from camcomp.model.motion.response import acting_force, aim_at
from camcomp.model.statics.target import Correction, settle
from camcomp.model.stock.warnings import stock_remarks, stock_warnings

MAX_ROUNDS, ARC_ROUNDS = 6, 4
STUCK = 0.95  # of the miss is left by a finer division that is no use, as where an arc passes the vertical
WITH_SHARES = 0.7  # of the tolerance at the points looked at: where the share bends, more is missed between them
COARSE_MM, FINE_MM = 8.0, 0.5  # distance of trial points on straight lines, without and with effects
SHARE_OF_WAVE = 0.15  # between them, at most: no row of points meets a wave at its zeros alone


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
    warnings: list[str]
    bands: Bands | None = None  # None: every number of the config is exact
    left: Floats | None = None  # (k, 3) mm of `after` that a policy leaves on purpose
    orienting: Orienting | None = None  # how the program states the orientation of the tool; None: it does not
    tilt_after: Floats | None = None  # (k,) rad of the loaded platform where the tip is judged
    fraction: Floats | None = None  # (N,) of the motion at every end point
    interpolated: Interpolation | None = None  # None: every point was solved exactly

    @property
    def missed(self) -> Floats:
        """`after` (k, 3) mm minus the errors that the policy accepts."""
        return self.after if self.left is None else self.after - self.left

    @property
    def programmed_words(self) -> Floats:
        """Words (N, 3) of the program's orientation at every end point; only in programs with orientation."""
        assert self.fraction is not None and self.orienting is not None
        turn, rows = self.program.path.orientation, self.rows
        if turn is None:
            return np.tile(UPRIGHT[self.orienting.form], (len(rows.piece), 1))
        return turn.words(rows.motion, self.fraction)

    @property
    def lines(self) -> Ints:
        """Source line (N,) of every end point."""
        return self.program.path.line[self.rows.motion]

    def failed_checks(self, job: Job, tolerance_um: float) -> list[tuple[str, str]]:
        """Rule id and text of every check that the finished program does not pass."""
        out = []
        size = 1e3 * np.linalg.norm(self.missed, axis=1)
        worst = float(np.nanmax(size)) if len(size) else 0.0
        if not worst <= tolerance_um * (1.0 + 1e-9):
            out.append(("CC601", f"{worst:.3f} um are left, more than the tolerance of {tolerance_um:g} um"))
        step = self.program.step_mm(job.config.control.resolution_mm)
        out += worse_than_before(error_size(self.before).max_um, error_size(self.after).max_um, step)
        for a, name in enumerate(job.real_machine.actuators):
            low, high = job.machine.limits[a]
            value = self.state.rho[:, a]
            over = np.flatnonzero((value < low) | (value > high))
            if len(over):
                unit, k = ("deg", 180.0 / np.pi) if job.machine.revolute[a] else ("mm", 1.0)
                span = f"{k * low:g} to {k * high:g} {unit}"
                out.append(
                    ("CC602", f"actuator {name} leaves its travel {span} at {named_lines(np.unique(self.lines[over]))}")
                )
        return out + interpolation_failed(self.interpolated)


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Where the original program takes the tip (N, 3) mm, program frame, for one cause at a time: seed Fig. 4."""

    chain_error: Floats  # imperfect chains, no load
    force: Floats  # perfect chains, cutting force


def trajectories(result: Compensated, job: Job) -> Trajectories:
    """The trajectories of the original program that a compensation does not need itself."""
    target = job.frame.to_machine(result.rows.target)
    force = job.frame.vectors(result.rows.force)
    rotation = None if result.orienting is None else result.orienting.platform(result.programmed_words)
    alone, _ = settle(job.real_machine, target, np.zeros_like(force), rotation=rotation)
    loaded, _ = settle(job.perfect_machine, target, force, rotation=rotation)
    return Trajectories(job.frame.to_program(alone), job.frame.to_program(loaded))


def compensate(
    program: Program, job: Job, *, method: str, tolerance_um: float, version: str, part: Part | None = None,
    arcs: bool | None = None, engaged: Engaged | None = None,
) -> Compensated:  # fmt: skip
    """The corrected program. Raises PhysicsError where the machine cannot do what is asked.

    arcs: programmed arcs come out as arcs where those are fewer than lines; None asks the machine file. Where that does
    not say either they do when the control, in a path mode that is stated, is then faster or nearer to the path.

    part: the motions to be corrected and written, when the program is a part of a longer one. The others are only there
    because their neighbours depend on them: they are not divided, and their errors do not count. engaged: what the tool
    meets along the path, when the program has been followed through its stock before.
    """
    wanted = job.config.compensation.arcs if arcs is None else arcs
    engaged = engaged or job.engaged(program)
    asked = partial(
        _compensated, program, job, engaged, method=method, tolerance_um=tolerance_um, version=version, part=part
    )
    found = asked(arcs=bool(wanted))
    own = slice(None) if part is None else slice(part.first, part.last)
    able = bool((program.path.kind[own] == ARC).any()) and not job.causes
    if wanted is None and able and (found.control.leaves_room(tolerance_um) or found.control.apart):
        other = asked(arcs=True)
        as_good = found.control.apart and not other.control.apart  # in the program's own mode
        as_good = as_good and not found.control.better_than(other.control, tolerance_um)
        if as_good or other.control.better_than(found.control, tolerance_um):
            return other
    return found


def _compensated(
    program: Program,
    job: Job,
    engaged: Engaged | None,
    *,
    method: str,
    tolerance_um: float,
    version: str,
    part: Part | None,
    arcs: bool,
) -> Compensated:
    """The corrected program, its arcs as arcs or as lines."""
    path, resolution = program.path, program.step_mm(job.config.control.resolution_mm)
    spacing = _spacing(job)
    base = lay_track(path, job.conditions, engaged)
    orienting = Orienting.of(program, job)
    if orienting is not None:
        arcs = False  # a circle of the tip does not turn the tool as a correction needs it
        refuse_unfollowed(job, method, part)
    turns = load_turns(job, base)
    track, turning = cut_at_reversals(job, cut_at_knots(job, turns.cut(base), spacing), spacing)
    shares = shares_of(job, base)
    if shares is not None:
        track, of = shares.divided(shares.with_jumps(track))
        turning = turning[of]
    pushed = turns.pieces(base, track)
    turning |= pushed
    corrected = corrected_pieces(path, track)
    feeding = corrected & (path.kind[track.motion] != RAPID)
    if part is not None:
        feeding &= (track.motion >= part.first) & (track.motion < part.last)

    trial = trial_nodes(track.length, track.angle, feeding & ~turning & (track.length > 0.0), spacing)
    with part_of_work(0.0, 0.4, points=True):
        aimed = _aim(
            program, job, track=track, nodes=trial, corrected=corrected, method=method, shares=shares,
            orienting=orienting,
        )  # fmt: skip
    curve, weight = aimed.commanded, 1e-3 * tolerance_um
    correction = aimed.commanded - track.points(trial.piece, trial.w)
    kept = _kept(track, trial, correction, 0.5 * resolution)
    if orienting is not None:
        curve = np.column_stack((curve, orienting.lengths(aimed.words, weight)))
        kept &= orienting.kept(track, trial, aimed.words)
    second = second_derivative(trial, curve)
    goal = error_goals(tolerance_um, resolution, _largest(track, trial, np.linalg.norm(correction, axis=1)))
    budget = chord_budget(goal, resolution)
    tolerance = budget.copy()
    if shares is not None:
        goal *= WITH_SHARES
    tolerance[kept | turning] = np.inf
    able = feeding & ~kept & (arcs and not job.causes)  # what drives leave over has waves that no arc follows
    bend = Bend.of(track=track, trial=trial, commanded=aimed.commanded, second=second, tolerance=tolerance, able=able)
    rounded = np.maximum(budget - np.sqrt(0.5) * resolution, 0.1 * budget)  # the centre is rounded, too
    tolerance[bend.use] = rounded[bend.use]
    last, last_count = np.full(len(tolerance), np.inf), np.zeros(len(tolerance), np.int64)
    for round_ in range(MAX_ROUNDS):
        nodes, shift = bend.divided(trial, tolerance)
        if (gone := bend.pointless(nodes)).any():
            bend.use &= ~gone
            tolerance[gone] = budget[gone]
            nodes, shift = bend.divided(trial, tolerance)
        with part_of_work(1.0 - 0.6 * 0.5**round_, 1.0 - 0.35 * 0.5**round_, points=True):
            commanded, circles, words = _bent(
                program, job, track=track, nodes=nodes, shift=shift, corrected=corrected, method=method, bend=bend,
                shares=shares, orienting=orienting,
            )  # fmt: skip
        if orienting is not None:
            words = words + orienting.from_lengths(shift[:, 3:], weight)
        rows = corrected_rows(
            program, job, track=track, nodes=nodes, commanded=commanded, kept=kept, circles=circles,
            begins=part is None or part.first == 0, shares=shares, orienting=orienting,
            words=None if orienting is None else words,
        )  # fmt: skip
        written = rewrite(
            program, output_of(path, rows), resolution_mm=job.config.control.resolution_mm, version=version,
            part=part, model=job.fingerprint,
        )  # fmt: skip
        points = judged_points(job, track, rows, feeding & ~pushed)
        after = see(
            job=job, points=points, ends=written.end, arcs=replace(rows.arcs, centre=written.centre),
            orienting=orienting, words=written.words,
        )  # fmt: skip
        left = None
        if shares is not None:
            left = shares.left(job, track, points.piece, points.w, travel=points.travel, before=points.before)
        worst = np.zeros(len(tolerance))
        missed_by = after.error if left is None else after.error - left
        size = np.where(after.status == 0, np.linalg.norm(missed_by, axis=1), np.inf)
        if after.tilt is not None:
            size = np.maximum(size, np.nan_to_num(after.tilt) * goal[points.piece] / MOST_TILT_RAD)
        np.maximum.at(worst, points.piece[points.judged], size[points.judged])
        missed = (worst > goal) & ~kept
        count = np.diff(nodes.first)
        stuck = missed & (worst >= STUCK * last) & (count > last_count)
        straighten = missed & bend.use & (stuck | (round_ >= ARC_ROUNDS - 1))
        missed &= ~stuck & ~straighten
        if not (missed | straighten).any():
            break
        last, last_count = np.where(straighten, np.inf, worst), count
        bend.use &= ~straighten
        tolerance[straighten] = budget[straighten]
        tolerance = np.where(missed, tolerance * np.clip(0.9 * goal / np.maximum(worst, 1e-12), 0.3, 0.9), tolerance)
    with part_of_work(0.8, 1.0, points=True):
        before = see_original(job, points)
    for seen in (after, before):
        judged = points.judged
        refuse_unsolved(program, track, points.piece[judged], points.target[judged], seen.status[judged])
    still = np.intersect1d(cut_without_spindle(track), path.line[track.motion[feeding]])
    rest = rests(program, rows, tolerance_um, part)
    if rest.any():
        written = rewrite(
            program, output_of(path, rows, rest), resolution_mm=job.config.control.resolution_mm, version=version,
            part=part, model=job.fingerprint,
        )  # fmt: skip
    seen = replace(after, error=missed_by)
    control = under_control(program, job, rows=rows, written=written, points=points, after=seen, rest=rest)
    if part is None and control.stated and 1e3 * control.off_joins > tolerance_um * (1.0 + 1e-9):
        apart = stays_apart(program, rows)
        if apart.any():
            other = under_control(
                program, job, rows=rows, written=written, points=points, after=seen, rest=rest, apart=apart
            )
            if other.better_than(control, tolerance_um):
                control = other
                written = rewrite(
                    program, output_of(path, rows, rest, apart), resolution_mm=job.config.control.resolution_mm,
                    version=version, model=job.fingerprint,
                )  # fmt: skip
    lines = path.line[track.motion[points.piece[points.judged]]]
    warnings = _warm_up(job) + control.warnings(lines, tolerance_um, program.language)
    warnings += [*turns.warning(), *spindle_warning(still)]
    if part is None:
        doubts = ForceDoubts(config=job.config)
        doubts.add(path)
        warnings += [*job.taken.remarks, *doubts.warnings()]
        warnings += stock_warnings(stock_remarks(job.config, path, track.engaged))
        if feeding.any() and kept[feeding].all():
            feeds = len(np.unique(track.motion[feeding]))
            warnings.append(below_step_warning(program.name, feeds, resolution))
    iterations = int(aimed.iterations.max(initial=0))
    done = _assemble(
        program, job, track=track, rows=rows, written=written, points=points, before=before, after=after,
        control=control, iterations=iterations, method=method, still=still, warnings=warnings,
    )  # fmt: skip
    told = points.along(written.end, replace(rows.arcs, centre=written.centre))
    share = None if shares is None else shares.of_ends(track, rows.piece, rows.w, rows.joining)
    as_told = replace(points, travel=commanded_travel(points, orienting, written.words))
    bands = bands_of(job, track, rows=rows, points=as_told, told=told, before=before, after=after, share=share)
    return replace(
        done, bands=bands, left=None if left is None else left[points.judged], orienting=orienting,
        tilt_after=None if after.tilt is None else after.tilt[points.judged], fraction=track.u(rows.piece, rows.w),
    )  # fmt: skip


def _spacing(job: Job) -> float:
    """Distance of trial points, mm: a screw's error has waves of a few mm, the scale of an encoder shorter ones."""
    waves = [SHARE_OF_WAVE * each for each in (cause.values.get("pitch_mm", 0.0) for cause in job.causes) if each > 0.0]
    return min([FINE_MM, *waves]) if job.causes else COARSE_MM


@dataclass(frozen=True, eq=False)
class _Aimed:
    commanded: Floats  # (k, 3) program frame
    iterations: Ints
    words: Floats  # (k, 3) of the orientation, zero where the program states none


def _aim(
    program: Program,
    job: Job,
    *,
    track: Track,
    nodes: Nodes,
    corrected: Bools,
    method: str,
    shares: Shares | None,
    orienting: Orienting | None = None,
) -> _Aimed:
    """Modified targets at nodes, program frame; nodes of uncorrected pieces stay as programmed."""
    on = corrected[nodes.piece]
    piece, w = nodes.piece[on], nodes.w[on]
    rapids = np.flatnonzero(corrected & (track.path.kind[track.motion] == RAPID) & (track.length > 0.0))
    if not job.causes:
        rapids = rapids[:0]
    between = np.repeat(rapids, len(WITHIN_RAPID))  # drives remember where they turned round
    order = np.lexsort((np.concatenate((w, np.tile(WITHIN_RAPID, len(rapids)))), np.concatenate((piece, between))))
    asked = np.argsort(order, kind="stable")[: len(piece)]
    piece, w = np.concatenate((piece, between))[order], np.concatenate((w, np.tile(WITHIN_RAPID, len(rapids))))[order]
    target = track.points(piece, w)
    words = np.zeros((len(nodes.piece), 3))
    if orienting is None:
        result = aim_at(job, target, travel_of(job, track, piece, w), method)
    else:
        words = orienting.programmed(track, nodes.piece, nodes.w)
        result, turned = orienting.aim(target, travel_of(job, track, piece, w), orienting.programmed(track, piece, w))
        words[on] = turned[asked]
    refuse_unsolved(program, track, piece, target, result.status)
    out = track.points(nodes.piece, nodes.w)
    out[on] = result.commanded[asked]
    if shares is not None:
        out = shares.taken(track, nodes.piece, nodes.w, track.points(nodes.piece, nodes.w), out)
    iterations = np.zeros(len(out), np.int64)
    iterations[on] = result.iterations[asked]
    return _Aimed(out, iterations, words)


def _bent(
    program: Program,
    job: Job,
    *,
    track: Track,
    nodes: Nodes,
    shift: Floats,
    corrected: Bools,
    method: str,
    bend: Bend,
    shares: Shares | None,
    orienting: Orienting | None = None,
) -> tuple[Floats, Arcs, Floats]:
    """Commanded tips (k, 3) at nodes, the circles of the moves that lead there as arcs, and the words (k, 3) of the
    orientation there. Turns off what cannot bend.
    """
    both, middle = arcs_out.middles(nodes, bend.use)
    aimed = _aim(
        program, job, track=track, nodes=both, corrected=corrected, method=method, shares=shares, orienting=orienting
    )
    solved = aimed.commanded
    commanded = solved[~middle] + shift[:, :3]
    circles = Arcs.none(len(commanded))
    to = np.flatnonzero((np.diff(nodes.piece, prepend=-1) == 0) & bend.use[nodes.piece])
    if len(to):
        motion = track.motion[nodes.piece[to]]
        flat = arcs_out.FLATTEST * program.step_mm(job.config.control.resolution_mm)
        found, wrong = arcs_out.through(
            start=commanded[to - 1], middle=solved[middle], end=commanded[to], axis=track.path.axis[motion],
            way=track.path.angle[motion], flat=flat,
        )  # fmt: skip
        circles.centre[to], circles.angle[to] = found.centre, found.angle
        bend.use[nodes.piece[to[wrong]]] = False
    return commanded, circles, aimed.words[~middle]


def _largest(track: Track, nodes: Nodes, size: Floats) -> Floats:
    """The largest of sizes (k,) at the nodes of every piece (p,)."""
    out = np.zeros(len(track.motion))
    np.maximum.at(out, nodes.piece, size)
    return out


def _kept(track: Track, nodes: Nodes, correction: Floats, half: float) -> Bools:
    """Pieces (p,) that stay as programmed, arcs as arcs: whole motions whose correction (k, 3) would be rounded away."""
    most = _largest(track, nodes, np.abs(correction).max(axis=1))
    out: Bools = (most <= half) & (np.bincount(track.motion)[track.motion] == 1)
    return out


def _warm_up(job: Job) -> list[str]:
    """Warnings of effects whose machine counts as warming up."""
    if job.config.process.temperature_C is not None:
        return []
    warm = dict.fromkeys(cause.name for cause in job.causes if getattr(cause.effect, "WARMS", False))
    return [f"{name}: without process: temperature_C the machine counts as warming up from 20 deg C" for name in warm]


def _assemble(
    program: Program,
    job: Job,
    *,
    track: Track,
    rows: CorrectedRows,
    written: Rewritten,
    points: JudgedPoints,
    before: Seen,
    after: Seen,
    control: UnderControl,
    iterations: int,
    method: str,
    still: Ints,
    warnings: list[str],
) -> Compensated:
    s = track.s0[rows.piece] + rows.w * track.length[rows.piece]
    feed = program.path.feed[rows.motion]
    default = job.config.process.feed_mm_per_min or np.nan
    speed = np.where(np.isnan(feed), default, feed)
    step = np.diff(s, prepend=0.0)
    moving = (rows.kind != RAPID) & (speed > 0.0)
    t = np.cumsum(np.where(moving, step / np.where(moving, speed, 1.0) * 60.0, 0.0))
    nominal = before.state.rho_nominal
    target = job.frame.to_machine(rows.target)
    warnings = [*program.warnings, *warnings]
    warnings += check_posture(program, job, program.path.line[rows.motion], target, nominal)
    state = after.state
    if method != "linear" and rows.words is None:  # words of orientation say what the control makes of them
        told = points.along(written.end, replace(rows.arcs, centre=written.centre))
        state = whole_pose(job, points, told, rows.corrected, state)
    force = acting_force(job, state.rho, points.travel.take(points.end))
    return Compensated(
        program=program, written=written, rows=rows, s=s, t=t, nominal=nominal, state=state, force=force,
        uncorrected=before.tip, before=before.error[points.judged], after=after.error[points.judged], control=control,
        judged=points.row[points.judged], iterations=iterations, method=method, without_spindle=still,
        warnings=warnings,
    )  # fmt: skip
