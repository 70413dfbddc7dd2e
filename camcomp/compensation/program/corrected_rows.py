"""The motions of a corrected program: the commanded nodes as end points, joining lines at jumps, the feed of each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from camcomp.compensation.program import arcs_out
from camcomp.compensation.program.arcs_out import Arcs
from camcomp.compensation.program.chords import Nodes
from camcomp.compensation.program.moves import refuse_unsolved, row_layout, travel_of
from camcomp.compensation.program.orienting import Orienting, aim_along
from camcomp.gcode.output import Output
from camcomp.gcode.program import Program
from camcomp.ground.datatypes import ARC, LINE, RAPID, Bools, Floats, Ints, Path
from camcomp.ground.records import dataclass, replace
from camcomp.ground.vectors import sizes
from camcomp.model.cutting.track import Track
from camcomp.model.job import Job

if TYPE_CHECKING:
    from camcomp.compensation.program.policy import Shares


@dataclass(frozen=True, eq=False, kw_only=True)
class CorrectedRows:
    """End points (N,) of the motions of the corrected program, in order."""

    piece: Ints
    motion: Ints
    w: Floats  # fraction of the piece at the end point
    kind: Ints
    joining: Bools
    corrected: Bools  # False: passes as programmed
    force: Floats  # (N, 3) N at the end point, program frame
    target: Floats  # (N, 3) mm programmed tip
    end: Floats  # (N, 3) mm commanded tip, program frame
    feed: Floats  # (N,) mm/min
    arcs: Arcs  # (N,) circles of corrected arcs that come out as arcs
    engagement: Floats  # (N, 2) depth of the cut mm, sum of the engaged arcs rad; NaN where no stock is known
    words: Floats | None = None  # (N, 3) of the orientation to be commanded; None: those of the program, if any

    def sweeps(self, path: Path) -> Floats:
        """Signed angles (N,) rad of the moves that are arcs, corrected or as programmed; 0 for lines."""
        out: Floats = np.where(self.arcs.on, self.arcs.angle, path.angle[self.motion])
        return np.where(self.kind == ARC, out, 0.0)

    def centres(self, path: Path, corrected: Floats) -> Floats:
        """Centres (N, 3) mm of the moves that are arcs, as `corrected` (N, 3) has them or as programmed."""
        programmed = (self.kind == ARC) & ~np.isfinite(corrected[:, 0])
        return np.where(programmed[:, None], path.centre.take(self.motion, axis=0), corrected)


def corrected_rows(
    program: Program,
    job: Job,
    track: Track,
    nodes: Nodes,
    *,
    commanded: Floats,
    kept: Bools,
    circles: Arcs,
    begins: bool,
    shares: Shares | None = None,
    orienting: Orienting | None = None,
    words: Floats | None = None,
) -> CorrectedRows:
    """End points of the corrected program: the nodes but the first of each piece, and joining lines at jumps.

    words (k, 3): of the orientation at the nodes, where there are some.
    """
    path = program.path
    k = np.arange(len(nodes.w)) - nodes.first[nodes.piece]
    kind = path.kind[track.motion]
    start, stop = (commanded.take(at, axis=0) for at in (nodes.first[:-1], nodes.first[1:] - 1))
    before = path.start[:1] if begins else start[:1]
    step = sizes(start - np.concatenate((before, stop[:-1])))
    layout = row_layout(path, track, step, program.step_mm(job.config.control.resolution_mm))
    keep = np.flatnonzero((k > 0) | layout.leading[nodes.piece])
    extra = np.flatnonzero(layout.trailing)
    piece = np.concatenate((nodes.piece[keep], extra))
    w = np.concatenate((nodes.w[keep], np.ones(len(extra))))
    joining = np.concatenate(((k == 0)[keep], np.ones(len(extra), np.bool_)))
    free, turned = _behind_cuts(program, job, track, extra, shares=shares, orienting=orienting)
    end = np.concatenate((commanded.take(keep, axis=0), free))
    circles = circles.take(keep).followed_by(len(extra))
    order = np.arange(len(piece))
    if len(extra):
        order = np.lexsort((joining & (w > 0.0), w, piece))
        piece, w, joining, end, circles = piece[order], w[order], joining[order], end[order], circles.take(order)
    trailing_row = joining & (w > 0.0)
    target = track.points(piece, w)
    force = track.force(piece, w)
    force[trailing_row] = 0.0
    rows_kind = np.where(kind[piece] == RAPID, RAPID, LINE)
    passed = ~layout.corrected[piece]
    whole = (passed | kept[piece]) & ~joining & (np.bincount(piece, minlength=len(kind)) == 1)[piece]
    rows_kind = np.where(circles.on, ARC, np.where(whole, kind[piece], rows_kind))
    end[whole & ~circles.on] = target[whole & ~circles.on]
    engagement = (
        np.broadcast_to(np.nan, (len(piece), 2)) if track.engaged is None else np.column_stack(track.sizes(piece, w))
    )
    if orienting is not None and words is not None:
        words = np.concatenate((words[keep], turned))[order]
        words[whole] = orienting.programmed(track, piece, w)[whole]
    rows = CorrectedRows(
        piece=piece, motion=track.motion[piece], w=w, kind=rows_kind, joining=joining, corrected=~passed, force=force,
        target=target, end=end, feed=np.empty(len(piece)), arcs=circles, engagement=engagement, words=words,
    )  # fmt: skip
    return replace(rows, feed=_feeds(program, track, rows))


def _behind_cuts(
    program: Program, job: Job, track: Track, piece: Ints, *, shares: Shares | None, orienting: Orienting | None
) -> tuple[Floats, Floats]:
    """Commanded tips (e, 3) mm behind the cuts of pieces (e,), without their force, and words (e, 3) of the orientation."""
    one = np.ones(len(piece))
    target, none = track.points(piece, one), np.zeros((len(piece), 3))
    if not len(piece):
        return target, none
    unloaded = replace(travel_of(job, track, piece, one), force=none)
    result, turned = aim_along(job, track, orienting, target, unloaded, piece=piece, w=one, tips_only=True)
    refuse_unsolved(program, track, piece, target, result.status)
    if shares is None:
        return result.commanded, turned
    behind = np.minimum(piece + 1, len(track.motion) - 1)  # where the next piece begins, with its share
    return shares.taken(track, behind, np.zeros(len(piece)), target, result.commanded), turned


def _feeds(program: Program, track: Track, rows: CorrectedRows) -> Floats:
    """Feed of every row so that the tip keeps its programmed speed: scaled by commanded over programmed length."""
    feed = program.path.feed[rows.motion]
    start = np.concatenate((program.path.start[:1], rows.end[:-1]))
    same = np.concatenate(([False], (rows.piece[1:] == rows.piece[:-1])))
    w0 = np.where(same, np.concatenate(([0.0], rows.w[:-1])), 0.0)
    programmed = (rows.w - w0) * track.length[rows.piece]
    commanded = arcs_out.lengths(start, rows.end, rows.arcs, program.path.axis, rows.motion)
    scale = np.divide(commanded, programmed, out=np.ones(len(feed)), where=programmed > 1e-6)
    unscaled = rows.joining | ((rows.kind != LINE) & ~rows.arcs.on) | ~rows.corrected | (programmed < 0.01)
    return np.where(unscaled, feed, feed * np.clip(scale, 0.2, 5.0))


def times_of(job: Job, program: Program, rows: CorrectedRows, s: Floats) -> Floats:
    """Time (N,) s at end points by the programmed feed, s (N,) mm along the path; rapids take none."""
    speed = job.conditions.feeds(program.path.feed[rows.motion])
    moving = (rows.kind != RAPID) & (speed > 0.0)
    out: Floats = np.cumsum(np.where(moving, np.diff(s, prepend=0.0) / np.where(moving, speed, 1.0) * 60.0, 0.0))
    return out


def output_of(path: Path, rows: CorrectedRows, rest: Bools | None = None, apart: Bools | None = None) -> Output:
    """The rows in the form of the writer. rest, apart (N,): force a stop at the end, forbid merging."""
    return Output(
        motion=rows.motion, kind=rows.kind.astype(np.int8), end=rows.end, centre=rows.centres(path, rows.arcs.centre),
        angle=rows.sweeps(path), feed=rows.feed, joining=rows.joining, rest=rest, apart=apart, words=rows.words,
    )  # fmt: skip
