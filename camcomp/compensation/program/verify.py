"""Verify a corrected program from its text alone: where does the loaded machine take the tip, and how far off is that?

The corrected program is read as the control reads it, its moves are matched to the motions of the original, and points
along every move go through the full model. The residual is the distance from the programmed path. Joining lines are
not counted.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from camcomp.compensation.bands.outcome import BandTotals, band_figures
from camcomp.compensation.bands.tip_field import tip_field_of
from camcomp.compensation.program.division import COARSE_MM, even_nodes, trial_nodes
from camcomp.compensation.program.line_ends import LOOP_MM, is_late
from camcomp.compensation.program.matching import Matching
from camcomp.compensation.program.moves import (
    WITHIN_RAPID,
    corrected_pieces,
    refuse_unsolved,
    row_layout,
    without_shared_ends,
)
from camcomp.compensation.program.orienting import Orienting
from camcomp.compensation.program.play import cut_for_drives, load_turns, passed_turns
from camcomp.compensation.program.programmed import Programmed
from camcomp.compensation.program.result import ErrorSum, LineResult, Verification
from camcomp.compensation.program.uncertainty import shares_of, tip_moves
from camcomp.compensation.program.under_control import of_text
from camcomp.gcode.program import Program
from camcomp.gcode.stamp import is_stamped, stamped_model
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, RAPID, Bools, Floats, Ints, Path
from camcomp.ground.progress import part, steps
from camcomp.ground.records import dataclass, field, replace
from camcomp.ground.vectors import largest_of_groups, sizes
from camcomp.model.cutting.track import lay_track
from camcomp.model.job import Job
from camcomp.model.motion.response import aim_at, respond
from camcomp.model.motion.travel import Travel

PER_SECTION = 4  # points looked at within each straight move or section of an arc
ARC_STEP = 0.1  # rad, section of an arc
LOOKS = 4  # of points far from the path, for another place on it
FAR_MM = 1e-3  # from the path
MANY = 0.1  # of the points: so many are far because of the program, not of their guess
MATCH_PASSES = 20  # tip and force settle on a place of the path; on a circle of 1 mm it takes ten
ALONG = 180  # sections of a piece to measure the path that ought to be commanded
UNEVEN = 0.02  # change of a piece's length by the correction from which that is worth while
PROBE_MM = 1e-4  # fraction of a piece
LARGEST_GAP_MM = 0.05  # of a piece, in one pass
ALLOWED_SHARE = 0.05  # of the correction, between the share that was taken and that of the policy


@dataclass(frozen=True, eq=False, kw_only=True)
class Verified:
    """Residuals (k,) mm at all points looked at along feed moves, and per source line."""

    residual: Floats
    lines: list[LineResult]
    joining: int
    control: dict[str, Any]  # figures of what the control makes of it
    warnings: list[str] = field(default_factory=list)
    missed: Floats | None = None  # (k,) mm beside what a policy leaves on purpose; None: it leaves nothing
    totals: BandTotals | None = None  # None: every number of the config is exact
    policy: str = "full"
    stamped: bool = True  # the program carries the stamp of a compensation

    def figures(self, tolerance_um: float) -> Verification:
        """The figures of a verification."""
        total = ErrorSum()
        total.add(self.residual[:, None])
        return Verification(
            tolerance_um=tolerance_um, residual=total.figures(), points=len(self.residual), joining_lines=self.joining,
            **self.control, warnings=self.warnings,
            **({} if self.totals is None else band_figures(self.totals, self.policy)), lines=tuple(self.lines),
        )  # fmt: skip

    @property
    def worst_um(self) -> float:
        """The largest distance from where the policy of the config wants the tip."""
        return 1e3 * float((self.residual if self.missed is None else self.missed).max(initial=0.0))


def verify(corrected: Program, original: Program, job: Job) -> Verified:
    """Residual of a corrected program. Raises CheckFailed CC604 when it is not one of this original."""
    track = lay_track(original.path, job.conditions, job.engaged(original))
    if is_late(job):
        track, _ = cut_for_drives(job, track)
    shares = shares_of(job, track)
    if shares is not None:
        track = shares.with_jumps(track)
    asked = _Original(original, job, track, shares, Orienting.of(original, job, corrected))
    with part(0.0, 0.3, points=True):
        begin, expected, reach = asked.commanded()
    step = sizes(begin - np.concatenate((original.path.start[:1], expected[:-1])))
    layout = row_layout(original.path, track, step, original.step_mm(job.config.control.resolution_mm))
    foreign = _other_model(corrected, job)
    matching = Matching(
        path=corrected.path, track=track, expected=expected, reach=reach, layout=layout,
        stamped=is_stamped(corrected.data),
    )  # fmt: skip
    first, last, joins = matching.match(foreign=bool(foreign))
    moving = np.flatnonzero(layout.corrected & (track.length > 0.0))
    points = _Points(asked, corrected.path, *_samples(corrected.path, moving, first[moving], last[moving]))
    guess = points.fraction(reach)
    with part(0.3, 0.9):
        residual, w = points.matched(guess)
    # Rapids and starts are only there because drives remember them.
    judged = (points.f > 0.0) & (original.path.kind[track.motion[points.piece]] != RAPID)
    judged &= ~passed_turns(load_turns(job, track), points.piece, points.move, points.f, w)
    travel, tip, error = points.tip_errors(w)
    seen = np.flatnonzero(judged & points.counted())
    control = of_text(original, corrected, job, points.move[seen], told=points.commanded[seen], error=error[seen])
    missed, totals = None, None
    if shares is not None:
        residual = sizes(tip - track.points(points.piece, w))
        missed = points.missed(w, travel, error)[judged]
    if job.config.uncertain:
        totals = points.expected_error(w, travel, tip, judged & (points.f == 1.0))
    return Verified(
        residual=residual[judged], lines=points.by_line(w, judged, residual, missed), joining=joins, control=control,
        warnings=[*original.warnings, *foreign], missed=missed, totals=totals, policy=job.config.compensation.policy,
        stamped=matching.stamped,
    )  # fmt: skip


def _other_model(corrected: Program, job: Job) -> list[str]:
    """A warning where the program was made for another machine or process."""
    stamped = stamped_model(corrected.data)
    if stamped in (None, job.fingerprint):
        return []
    text = f"the program was compensated for another machine or process (stamp: {stamped}, here: {job.fingerprint})"
    return [text]


def _samples(path: Path, pieces: Ints, first: Ints, last: Ints) -> tuple[Ints, Ints, Floats]:
    """Points looked at: piece (k,), move (k,) of the corrected path, and fraction (k,) of the move."""
    none = np.zeros(0, np.int64)
    move = np.concatenate([none, *(np.arange(a, b) for a, b in zip(first, last, strict=True))])
    piece = np.repeat(pieces, last - first)
    sections = np.ceil(np.abs(np.where(path.kind[move] == ARC, path.angle[move], 0.0)) / ARC_STEP)
    count = np.where(
        path.kind[move] == RAPID, len(WITHIN_RAPID) + 1, PER_SECTION * np.maximum(sections, 1).astype(np.int64)
    )
    nodes = even_nodes(count + 1)
    return piece[nodes.piece], move[nodes.piece], nodes.w


class _Original(Programmed):
    """The original program as it ought to be corrected; pieces (p,) of its track."""

    def commanded(self) -> tuple[Floats, Floats, Floats]:
        """Commanded tips (p, 3) at begin and end of every piece, as compensate would have them, and lengths (p,) mm between.

        Where the correction is large, a small arc grows or shrinks.
        """
        track, corrected, late = self.track, corrected_pieces(self.track.path, self.track), is_late(self.job)
        inner = corrected & ((track.angle != 0.0) | (late & (track.length > LOOP_MM)))
        nodes = trial_nodes(track.length, track.angle, inner, LOOP_MM if late else COARSE_MM)
        piece, w, of = without_shared_ends(track, nodes.piece, nodes.w)
        points, on = track.points(piece, w), np.flatnonzero(corrected[piece])
        result, _ = self.aim(piece[on], w[on])
        refuse_unsolved(self.program, track, piece[on], points[on], result.status)
        points[on] = result.commanded
        points = self.taken(piece, w, points).take(of, axis=0)
        inside = np.diff(nodes.piece) == 0
        reach = np.bincount(nodes.piece[1:][inside], sizes(np.diff(points, axis=0))[inside], len(corrected))
        return points[nodes.first[:-1]], points[nodes.first[1:] - 1], reach.astype(np.float64)


class _Points:
    """Points (k,) looked at: fractions f of the moves of the corrected path that belong to a piece of the original."""

    def __init__(self, asked: _Original, path: Path, piece: Ints, move: Ints, f: Floats) -> None:
        self.asked, self.path, self.piece, self.move, self.f = asked, path, piece, move, f
        self.commanded, turning = path_geometry.points(path, move, f), asked.orienting
        self.rotation = None if turning is None else turning.platform(turning.words(path, move, f))  # as commanded

    def counted(self) -> Bools:
        """Points (k,) that a compensation looks at, too: ends and middles of moves, quarters of arcs that it changed."""
        track, move = self.asked.track, self.move
        changed = (self.path.end[move] != track.path.end[track.motion[self.piece]]).any(axis=1)
        return np.asarray(self.f * np.where(changed & (self.path.kind[move] == ARC), 4, 2) % 1.0 == 0.0)

    def tip_errors(self, w: Floats) -> tuple[Travel, Floats, Floats]:
        """Travel at fractions w (k,) of the pieces, loaded tips (k, 3) mm, and their errors (k, 3) mm there.

        The travel is in the commanded orientation; errors that the policy accepts are none.
        """
        asked, travel = self.asked, self.asked.travel(self.piece, w)
        travel = travel if self.rotation is None else replace(travel, rotation=self.rotation)
        travel = replace(travel, time=np.maximum.accumulate(travel.time))  # also where the tip goes back on its path
        tip, _ = respond(asked.job, self.commanded, travel)
        return travel, tip, asked.missed(tip - asked.track.points(self.piece, w), self.piece, w, travel)

    def fraction(self, reach: Floats) -> Floats:
        """First guess (k,) of the fraction of each piece: by the length of the path that ought to be commanded."""
        piece, move, track = self.piece, self.move, self.asked.track
        length = path_geometry.lengths(self.path)
        before = np.cumsum(length) - length
        run = before[move] + self.f * length[move]
        n = int(piece.max(initial=-1)) + 1
        start, stop = np.full(n, np.inf), np.zeros(n)
        np.minimum.at(start, piece, before[move])
        np.maximum.at(stop, piece, run)
        share = np.clip((run - start[piece]) / np.maximum(stop - start, 1e-300)[piece], 0.0, 1.0)
        moves, first = np.zeros(n, np.int64), np.full(n, len(length))
        np.maximum.at(moves, piece, move)
        np.minimum.at(first, piece, move)
        # One move goes evenly, and so do many where the correction is small against the piece.
        uneven = np.flatnonzero((moves > first) & (np.abs(reach - track.length)[:n] > UNEVEN * track.length[:n]))
        w = np.linspace(0.0, 1.0, ALONG + 1)
        aimed = self.asked.aim(np.repeat(uneven, len(w)), np.tile(w, len(uneven)))[0].commanded
        for i, curve in zip(uneven, aimed.reshape(-1, len(w), 3), strict=True):
            way = np.concatenate(([0.0], np.cumsum(sizes(np.diff(curve, axis=0)))))
            on = piece == i
            share[on] = np.interp(share[on] * way[-1], way, w)
        return np.asarray(share)

    def matched(self, w: Floats) -> tuple[Floats, Floats]:
        """Distance (k,) mm of the loaded tip from the path that it ought to follow, and the fraction of the nearest point.

        Where loads turn round, fractions may settle on the wrong side: there they start again at that of the point before.
        """
        size, best = self._settled(w)
        cuts = self.path.kind[self.move] != RAPID
        for _ in range(LOOKS):
            far, again = np.flatnonzero(cuts & (size > FAR_MM)), best.copy()
            again[far] = np.where(self.piece[far] == self.piece[far - 1], best[far - 1], w[far])
            if (again == best).all() or len(far) > MANY * len(w):
                break
            other, there = self._settled(again)
            found = (other < 0.5 * size)[far].any()
            size, best = np.where(other < size, (other, there), (size, best))
            if not found:
                break
        return size, best

    def _settled(self, w: Floats) -> tuple[Floats, Floats]:
        """`matched` from a first guess on."""
        track, piece = self.asked.track, self.piece

        def seen(w: Floats) -> tuple[Floats, Floats]:
            """Distance from the place, and how far the tip lies ahead of it, mm."""
            gap = self.tip_errors(w)[2]
            tangent = path_geometry.tangents(track.path, track.motion[piece], track.u(piece, w))
            return sizes(gap), np.sum(gap * tangent, axis=1)

        # With the place the force turns, and the tip with the force; on small arcs further than the place, so by secant.
        last_w = np.where(w < 0.5, w + PROBE_MM, w - PROBE_MM)
        nearest, last_along = seen(last_w)
        best = last_w
        for _ in steps(range(MATCH_PASSES), MATCH_PASSES):
            size, along = seen(w)
            best, nearest = np.where(size < nearest, w, best), np.fmin(size, nearest)
            change = along - last_along
            slope = np.divide(w - last_w, -change, out=1.0 / track.length[piece], where=np.abs(change) > 1e-12)
            better = np.clip(w + np.clip(along * slope, -LARGEST_GAP_MM, LARGEST_GAP_MM), 0.0, 1.0)
            if np.abs((better - w) * track.length[piece]).max(initial=0.0) < 1e-7:
                break
            last_w, last_along, w = w, along, better
        return nearest, best

    def missed(self, w: Floats, travel: Travel, error: Floats) -> Floats:
        """Distances (k,) mm of the loaded tip from where the policy wants it.

        The share that was taken may be another than the policy's by ALLOWED_SHARE: it rests on derivatives, and the rest
        of the distance on the solver.
        """
        target = self.asked.track.points(self.piece, w)
        off = aim_at(self.asked.job, target, travel, "newton").commanded - target
        size = np.maximum(sizes(off), 1e-12)
        along = np.einsum("ni,ni->n", error, off) / size
        along = np.clip(along, -ALLOWED_SHARE * size, ALLOWED_SHARE * size)
        return sizes(error - (along / size)[:, None] * off)

    def expected_error(self, w: Floats, travel: Travel, tip: Floats, end: Bools) -> BandTotals:
        """What machines that may be leave at the ends (k,) of moves; the other points are only there because drives remember."""
        job, track, shares = self.asked.job, self.asked.track, self.asked.shares
        at = np.arange(len(end)) if job.causes else np.flatnonzero(end)
        piece, w, tip, ends = self.piece[at], w[at], tip[at], np.flatnonzero(end[at])
        moves = tip_moves(job, track, piece, w, commanded=self.commanded[at], travel=travel.take(at), base=tip)
        taken = None if shares is None else shares.at(track, piece, w)[ends]
        totals = BandTotals(tip_field_of(job).inputs)
        totals.add((tip - track.points(piece, w))[ends], moves.take(ends), taken)
        return totals

    def by_line(self, w: Floats, judged: Bools, residual: Floats, missed: Floats | None) -> list[LineResult]:
        """Results by source line, of residuals (k,) and of those beyond the policy (j,) at the judged points, mm."""
        job, track, program = self.asked.job, self.asked.track, self.asked.program
        piece, residual, vertex, w = self.piece[judged], residual[judged], self.f[judged] == 1.0, w[judged]
        target, travel = track.points(piece[vertex], w[vertex]), self.asked.travel(piece[vertex], w[vertex])
        # solver error: model tip of the exact command of the nearest point, minus that point
        tip, _ = respond(job, aim_at(job, target, travel, "newton").commanded, travel)
        convergence = sizes(tip - target)
        numbers, at = np.unique(program.path.line[track.motion[piece]], return_inverse=True)
        rounding = 0.5 * np.sqrt(3.0) * 1e3 * program.step_mm(job.config.control.resolution_mm)
        largest = partial(largest_of_groups, groups=len(numbers))
        moves = np.bincount(at[vertex], minlength=len(numbers))
        whole, at_ends = largest(residual, at), largest(residual[vertex], at[vertex])
        columns = np.column_stack((whole, largest(convergence, at[vertex]), at_ends, np.maximum(0.0, whole - at_ends)))
        names = ["residual_um", "convergence_um", "vertex_um", "chord_um"]
        if missed is not None:
            columns, names = np.column_stack((columns, largest(missed, at))), [*names, "missed_um"]
        return [
            LineResult(line=line, moves=count, rounding_um=rounding, **dict(zip(names, row, strict=True)))
            for line, count, row in zip(numbers.tolist(), moves.tolist(), (1e3 * columns).tolist(), strict=True)
        ]
