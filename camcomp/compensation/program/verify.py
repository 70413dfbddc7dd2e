"""Verify a corrected program from its text alone: where does the loaded machine take the tip, and how far off is that?

The corrected program is read as the control reads it, its moves are matched to the motions of the original, and points
along every move go through the full model. The residual is the distance from the programmed path. Joining lines are
not counted.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from camcomp.compensation.bands.outcome import BandTotals, band_figures
from camcomp.compensation.program.chords import trial_nodes
from camcomp.compensation.program.load_turns import load_turns
from camcomp.compensation.program.matching import match_moves
from camcomp.compensation.program.moves import (
    WITHIN_RAPID,
    corrected_pieces,
    refuse_unsolved,
    row_layout,
    travel_of,
)
from camcomp.compensation.program.orienting import Orienting
from camcomp.compensation.program.policy import Shares, shares_of
from camcomp.compensation.program.result import ErrorSize, LineResult, Verification
from camcomp.compensation.program.uncertainty import Uncertainty
from camcomp.compensation.program.under_control import of_text
from camcomp.gcode.program import Program
from camcomp.gcode.stamp import is_stamped, stamped_model
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, RAPID, Bools, Floats, Ints, Path
from camcomp.ground.progress import part, steps
from camcomp.model.cutting.track import Track, lay_track
from camcomp.model.job import Job
from camcomp.model.motion.response import Travel, aim_at, respond
from camcomp.model.statics.target import Correction

PER_SECTION = 4  # points looked at within each straight move or section of an arc
ARC_STEP = 0.1  # rad, section of an arc
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
        size = 1e3 * self.residual
        residual = ErrorSize(
            rms_um=float(np.sqrt(np.mean(size**2))) if len(size) else 0.0,
            max_um=float(size.max()) if len(size) else 0.0,
        )
        return Verification(
            tolerance_um=tolerance_um, residual=residual, points=len(size), joining_lines=self.joining,
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
    shares = shares_of(job, track)
    if shares is not None:
        track = shares.with_jumps(track)
    corrected_ones = corrected_pieces(original.path, track)
    orienting = Orienting.of(original, job, corrected)
    with part(0.0, 0.3, points=True):
        begin, expected = (
            _expected(original, job, track=track, corrected=corrected_ones, w=w, shares=shares, orienting=orienting)
            for w in (0.0, 1.0)
        )
    step = np.linalg.norm(begin - np.concatenate((original.path.start[:1], expected[:-1])), axis=1)
    layout = row_layout(original.path, track, step, original.step_mm(job.config.control.resolution_mm))
    reach = _reach(original, job, track, corrected_ones, orienting)
    warnings, foreign = list(original.warnings), _other_model(corrected, job)
    first, last, joins = match_moves(
        corrected.path, track, expected, reach, layout, stamped=is_stamped(corrected.data), foreign=bool(foreign)
    )
    moving = np.flatnonzero(layout.corrected & (track.length > 0.0))
    piece, move, f = _samples(corrected.path, moving, first[moving], last[moving])
    commanded = path_geometry.points(corrected.path, move, f)
    guess = _fraction(job, track, reach=reach, path=corrected.path, piece=piece, move=move, f=f, orienting=orienting)
    rotation = None if orienting is None else orienting.of_moves(corrected.path, move, f)
    with part(0.3, 0.9):
        residual, w = _residual(job, track, piece=piece, commanded=commanded, w=guess, shares=shares, rotation=rotation)
    # Rapids and starts are only there because drives remember them.
    judged = (f > 0.0) & (original.path.kind[track.motion[piece]] != RAPID)
    judged &= ~load_turns(job, track).passed(piece, move, f, w)
    end = judged & (f == 1.0)
    control = _under_control(
        original, corrected, job=job, track=track, piece=piece, move=move, commanded=commanded, w=w, judged=judged,
        shares=shares, rotation=rotation,
    )  # fmt: skip
    missed, totals = None, None
    if shares is not None:
        residual, missed = _beside(job=job, track=track, piece=piece, commanded=commanded, w=w, shares=shares)
        missed = missed[judged]
    if job.config.uncertain:
        totals = _expected_error(
            job, track, piece=piece, commanded=commanded, w=w, end=end, shares=shares, rotation=rotation
        )
    piece, residual, w, vertex = piece[judged], residual[judged], w[judged], f[judged] == 1.0
    convergence = _convergence(job, track, piece[vertex], w[vertex])
    lines = _per_line(
        original, job, track=track, piece=piece, vertex=vertex, residual=residual, convergence=convergence,
        missed=missed,
    )  # fmt: skip
    return Verified(
        residual=residual, lines=lines, joining=joins, control=control, warnings=[*warnings, *foreign], missed=missed,
        totals=totals, policy=job.config.compensation.policy, stamped=is_stamped(corrected.data),
    )  # fmt: skip


def _under_control(
    original: Program,
    corrected: Program,
    *,
    job: Job,
    track: Track,
    piece: Ints,
    move: Ints,
    commanded: Floats,
    w: Floats,
    judged: Bools,
    shares: Shares | None,
    rotation: Floats | None = None,
) -> dict[str, Any]:
    """Contour errors at the judged points (k,); errors that the policy accepts are subtracted."""
    travel = _told(travel_of(job, track, piece, w), rotation)
    error = respond(job, commanded, travel)[0] - track.points(piece, w)
    if shares is not None:
        error = error - shares.left(job, track, piece, w, travel)
    return of_text(
        original=original, corrected=corrected, job=job, move=move[judged], told=commanded[judged], error=error[judged]
    )


def _beside(job: Job, track: Track, piece: Ints, commanded: Floats, w: Floats, shares: Shares) -> tuple[Floats, Floats]:
    """Distances (k,) mm of the loaded tip from its place on the programmed path, and from where the policy wants it.

    The share that was taken may be another than the policy's by ALLOWED_SHARE: it rests on derivatives, and the rest of the distance on
    the solver.
    """
    travel, target = travel_of(job, track, piece, w), track.points(piece, w)
    tip, _ = respond(job, commanded, travel)
    off = aim_at(job, target, travel, "newton").commanded - target
    beside = tip - target - shares.left(job, track, piece, w, travel)
    size = np.maximum(np.linalg.norm(off, axis=1), 1e-12)
    along = np.einsum("ni,ni->n", beside, off) / size
    along = np.clip(along, -ALLOWED_SHARE * size, ALLOWED_SHARE * size)
    return np.linalg.norm(tip - target, axis=1), np.linalg.norm(beside - (along / size)[:, None] * off, axis=1)


def _expected_error(
    job: Job,
    track: Track,
    *,
    piece: Ints,
    commanded: Floats,
    w: Floats,
    end: Bools,
    shares: Shares | None,
    rotation: Floats | None,
) -> BandTotals:
    """What machines that may be leave at the ends (k,) of moves; the other points are only there because drives remember."""
    uncertainty = Uncertainty(job, track)
    at = np.arange(len(piece)) if job.causes else np.flatnonzero(end)
    piece, w, commanded, end = piece[at], w[at], commanded[at], end[at]
    travel = _told(travel_of(job, track, piece, w), None if rotation is None else rotation[at])
    tip, _ = respond(job, commanded, travel)
    moves = uncertainty.moves(piece, w, commanded=commanded, travel=travel, free=np.zeros(len(at), np.bool_), base=tip)
    taken = None if shares is None else shares.at(track, piece, w)[end]
    totals = BandTotals(uncertainty.inputs)
    totals.add((tip - track.points(piece, w))[end], moves.take(np.flatnonzero(end)), taken)
    return totals


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
    points = count + 1
    begin = np.cumsum(points) - points
    k = np.arange(points.sum()) - np.repeat(begin, points)
    return np.repeat(piece, points), np.repeat(move, points), k / np.repeat(count, points)


def _told(travel: Travel, rotation: Floats | None) -> Travel:
    """The travel with the orientation that the corrected program commands."""
    return travel if rotation is None else replace(travel, rotation=rotation)


def _aimed(job: Job, track: Track, piece: Ints, w: Floats, orienting: Orienting | None) -> Correction:
    """Commands for the programmed points, as compensate has them."""
    target, travel = track.points(piece, w), travel_of(job, track, piece, w)
    if orienting is None:
        return aim_at(job, target, travel, "newton")
    return orienting.aim(target, travel, orienting.programmed(track, piece, w))[0]


def _expected(
    program: Program,
    job: Job,
    *,
    track: Track,
    corrected: Bools,
    w: float,
    shares: Shares | None,
    orienting: Orienting | None,
) -> Floats:
    """Commanded tip (p, 3) at fraction w of every piece, as compensate would have it."""
    pieces = np.arange(len(track.motion))
    at = np.full(len(pieces), w)
    out = track.points(pieces, at)
    on = np.flatnonzero(corrected)
    result = _aimed(job, track, on, at[on], orienting)
    refuse_unsolved(program, track, on, out[on], result.status)
    out[on] = result.commanded
    return out if shares is None else shares.taken(track, pieces, at, track.points(pieces, at), out)


def _reach(program: Program, job: Job, track: Track, corrected: Bools, orienting: Orienting | None) -> Floats:
    """Length (p,) mm of the commanded path of every piece; where the correction is large, a small arc grows or shrinks."""
    angle = np.where(program.path.kind == ARC, np.abs(program.path.angle), 0.0)[track.motion] * (track.u1 - track.u0)
    nodes = trial_nodes(track.length, angle, corrected & (angle > 0.0))
    points = track.points(nodes.piece, nodes.w)
    on = corrected[nodes.piece]
    points[on] = _aimed(job, track, nodes.piece[on], nodes.w[on], orienting).commanded
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    inside = np.diff(nodes.piece) == 0
    return np.bincount(nodes.piece[1:][inside], step[inside], len(corrected)).astype(np.float64)


def _fraction(
    job: Job,
    track: Track,
    *,
    reach: Floats,
    path: Path,
    piece: Ints,
    move: Ints,
    f: Floats,
    orienting: Orienting | None,
) -> Floats:
    """First guess (k,) of the fraction of each piece: by the length of the path that ought to be commanded."""
    length = path_geometry.lengths(path)
    before = np.cumsum(length) - length
    run = before[move] + f * length[move]
    n = int(piece.max(initial=-1)) + 1
    start, stop = np.full(n, np.inf), np.zeros(n)
    np.minimum.at(start, piece, before[move])
    np.maximum.at(stop, piece, run)
    share = np.clip((run - start[piece]) / np.maximum(stop - start, 1e-300)[piece], 0.0, 1.0)
    moves = np.zeros(n, np.int64)
    np.maximum.at(moves, piece, move)
    first = np.full(n, len(length))
    np.minimum.at(first, piece, move)
    # One move goes evenly, and so do many where the correction is small against the piece.
    uneven = np.flatnonzero((moves > first) & (np.abs(reach - track.length)[:n] > UNEVEN * track.length[:n]))
    w = np.linspace(0.0, 1.0, ALONG + 1)
    at, along = np.repeat(uneven, len(w)), np.tile(w, len(uneven))
    aimed = _aimed(job, track, at, along, orienting).commanded.reshape(-1, len(w), 3)
    for i, curve in zip(uneven, aimed, strict=True):
        way = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))))
        on = piece == i
        share[on] = np.interp(share[on] * way[-1], way, w)
    out: Floats = share
    return out


def _residual(
    job: Job, track: Track, *, piece: Ints, commanded: Floats, w: Floats, shares: Shares | None, rotation: Floats | None
) -> tuple[Floats, Floats]:
    """Distance (k,) mm of the loaded tip from the programmed path, and the fraction of the nearest point.

    With shares of the correction: from the path on which they want it.
    """

    def seen(w: Floats) -> tuple[Floats, Floats]:
        """Distance from the place, and how far the tip lies ahead of it, mm."""
        travel = _told(travel_of(job, track, piece, w), rotation)
        tip, _ = respond(job, commanded, travel)
        gap = tip - track.points(piece, w)
        if shares is not None:
            gap = gap - shares.left(job, track, piece, w, travel)
        tangent = path_geometry.tangents(track.path, track.motion[piece], track.u(piece, w))
        return np.linalg.norm(gap, axis=1), np.sum(gap * tangent, axis=1)

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


def _convergence(job: Job, track: Track, piece: Ints, w: Floats) -> Floats:
    """Solver error (k,) mm: model tip of the exact command of the nearest point, minus that point."""
    target, travel = track.points(piece, w), travel_of(job, track, piece, w)
    tip, _ = respond(job, aim_at(job, target, travel, "newton").commanded, travel)
    out: Floats = np.linalg.norm(tip - target, axis=1)
    return out


def _per_line(
    original: Program,
    job: Job,
    *,
    track: Track,
    piece: Ints,
    vertex: Bools,
    residual: Floats,
    convergence: Floats,
    missed: Floats | None,
) -> list[LineResult]:
    line = original.path.line[track.motion[piece]]
    rounding = 0.5 * np.sqrt(3.0) * 1e3 * original.step_mm(job.config.control.resolution_mm)
    out = []
    for number in np.unique(line):
        on = line == number
        v, all_of_it = float(residual[on & vertex].max()), float(residual[on].max())
        solver = float(convergence[line[vertex] == number].max())
        chord = max(0.0, all_of_it - v)
        out.append(
            LineResult(
                line=int(number),
                moves=int((on & vertex).sum()),
                residual_um=1e3 * all_of_it,
                convergence_um=1e3 * solver,
                rounding_um=rounding,
                vertex_um=1e3 * v,
                chord_um=1e3 * chord,
                **({} if missed is None else {"missed_um": 1e3 * float(missed[on].max())}),
            )
        )
    return out
