"""The motions of a corrected program: the commanded nodes as end points, joining lines at jumps, the feed of each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from camcomp.compensation.program.division import Nodes, begins_of, sweeps
from camcomp.compensation.program.moves import refuse_unsolved, row_layout
from camcomp.compensation.program.programmed import Programmed
from camcomp.gcode.output import Output
from camcomp.gcode.program import Program
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, LINE, RAPID, Bools, Curves, Floats, Ints, Path
from camcomp.ground.records import dataclass, replace
from camcomp.ground.vectors import sizes
from camcomp.model.cutting.track import Track
from camcomp.model.job import Job


@dataclass(frozen=True, eq=False, kw_only=True)
class CorrectedRows:
    """End points (N,) of the motions of the corrected program, in order."""

    piece: Ints
    motion: Ints
    w: Floats  # fraction of the piece at the end point
    kind: NDArray[np.int8]
    joining: Bools
    corrected: Bools  # False: passes as programmed
    force: Floats  # (N, 3) N at the end point, program frame
    target: Floats  # (N, 3) mm programmed tip
    end: Floats  # (N, 3) mm commanded tip, program frame
    feed: Floats  # (N,) mm/min
    centre: Floats  # (N, 3) mm, of arcs
    angle: Floats  # (N,) rad, of arcs
    bent: Bools  # corrected arcs that come out as arcs
    engagement: Floats  # (N, 2) depth of the cut mm, sum of the engaged arcs rad; NaN where no stock is known
    words: Floats | None = None  # (N, 3) of the orientation to be commanded; None: those of the program, if any

    def curves(self, path: Path, end: Floats, centre: Floats) -> Curves:
        """The moves (N,) with these end points (N, 3), and centres (N, 3) of corrected arcs; NaN makes a line of them."""
        motion, bent = self.motion, np.flatnonzero(self.bent)
        start = np.concatenate((path.start[motion[:1]], end[:-1]))
        axis, kind, centres, angle = path.axis.take(motion, axis=0), self.kind, self.centre, self.angle
        if len(bent):
            a, b, n, c = start[bent], end[bent], axis[bent], centre[bent]
            c = c + np.sum((a - c) * n, axis=1, keepdims=True) * n  # at the height of the start as it is rounded
            kind, centres, angle = kind.copy(), centres.copy(), angle.copy()
            kind[bent] = np.where(np.isfinite(c[:, 0]), ARC, LINE)
            centres[bent], angle[bent] = c, sweeps(a, b, c, n, angle[bent])
        return Curves(kind=kind, start=start, end=end, centre=centres, axis=axis, angle=angle)


def corrected_rows(
    asked: Programmed,
    nodes: Nodes,
    *,
    commanded: Floats,
    kept: Bools,
    centre: Floats,
    begins: bool,
    words: Floats | None,
) -> CorrectedRows:
    """End points of the corrected program: the nodes but the first of each piece, and joining lines at jumps.

    centre (k, 3): of the moves that lead to the nodes as arcs, NaN for lines. words (k, 3): of the orientation at the nodes,
    where there are some.
    """
    program, track = asked.program, asked.track
    path = program.path
    k = np.arange(len(nodes.w)) - nodes.first[nodes.piece]
    kind = path.kind[track.motion]
    start, stop = (commanded.take(at, axis=0) for at in (nodes.first[:-1], nodes.first[1:] - 1))
    before = path.start[:1] if begins else start[:1]
    step = sizes(start - np.concatenate((before, stop[:-1])))
    layout = row_layout(path, track, step, program.step_mm(asked.job.config.control.resolution_mm))
    keep = np.flatnonzero((k > 0) | layout.leading[nodes.piece])
    extra = np.flatnonzero(layout.trailing)
    piece = np.concatenate((nodes.piece[keep], extra))
    w = np.concatenate((nodes.w[keep], np.ones(len(extra))))
    joining = np.concatenate(((k == 0)[keep], np.ones(len(extra), np.bool_)))
    free, turned = _behind_cuts(asked, extra)
    end = np.concatenate((commanded.take(keep, axis=0), free))
    centre = np.concatenate((centre.take(keep, axis=0), np.full((len(extra), 3), np.nan)))
    order = np.arange(len(piece))
    if len(extra):
        order = np.lexsort((joining & (w > 0.0), w, piece))
        piece, w, joining, end, centre = piece[order], w[order], joining[order], end[order], centre[order]
    trailing_row = joining & (w > 0.0)
    target = track.points(piece, w)
    force = track.force(piece, w)
    force[trailing_row] = 0.0
    rows_kind = np.where(kind[piece] == RAPID, RAPID, LINE)
    passed = ~layout.corrected[piece]
    whole = (passed | kept[piece]) & ~joining & (np.bincount(piece, minlength=len(kind)) == 1)[piece]
    motion, bent = track.motion[piece], np.isfinite(centre[:, 0])
    rows_kind = np.where(bent, ARC, np.where(whole, kind[piece], rows_kind)).astype(np.int8)
    end[whole & ~bent] = target[whole & ~bent]
    if len(own := np.flatnonzero((rows_kind == ARC) & ~bent)):
        centre[own] = path.centre[motion[own]]
    engagement = (
        np.broadcast_to(np.nan, (len(piece), 2)) if track.engaged is None else np.column_stack(track.sizes(piece, w))
    )
    if words is not None:
        words = np.concatenate((words[keep], turned))[order]
        words[whole] = asked.words(piece, w)[whole]
    angle = np.where(rows_kind == ARC, path.angle[motion], 0.0)
    rows = CorrectedRows(
        piece=piece, motion=motion, w=w, kind=rows_kind, joining=joining, corrected=~passed, force=force, target=target,
        end=end, feed=np.empty(len(piece)), centre=centre, angle=angle, bent=bent, engagement=engagement, words=words,
    )  # fmt: skip
    curves = rows.curves(path, end, centre)
    return replace(rows, angle=curves.angle, feed=_feeds(program, track, rows, path_geometry.lengths(curves)))


def _behind_cuts(asked: Programmed, piece: Ints) -> tuple[Floats, Floats]:
    """Commanded tips (e, 3) mm behind the cuts of pieces (e,), without their force, and words (e, 3) of the orientation."""
    one, track = np.ones(len(piece)), asked.track
    target, none = track.points(piece, one), np.zeros((len(piece), 3))
    if not len(piece):
        return target, none
    result, turned = asked.aim(piece, one, replace(asked.travel(piece, one), force=none), tips_only=True)
    refuse_unsolved(asked.program, track, piece, target, result.status)
    behind = np.minimum(piece + 1, len(track.motion) - 1)  # where the next piece begins, with its share
    return asked.taken(behind, np.zeros(len(piece)), result.commanded, target), turned


def _feeds(program: Program, track: Track, rows: CorrectedRows, commanded: Floats) -> Floats:
    """Feed of every row so that the tip keeps its programmed speed: scaled by commanded (N,) mm over programmed length."""
    feed = program.path.feed[rows.motion]
    programmed = (rows.w - begins_of(rows.piece, rows.w)) * track.length[rows.piece]
    scale = np.divide(commanded, programmed, out=np.ones(len(feed)), where=programmed > 1e-6)
    unscaled = rows.joining | ((rows.kind != LINE) & ~rows.bent) | ~rows.corrected | (programmed < 0.01)
    return np.where(unscaled, feed, feed * np.clip(scale, 0.2, 5.0))


def times_of(job: Job, program: Program, rows: CorrectedRows, s: Floats) -> Floats:
    """Time (N,) s at end points by the programmed feed, s (N,) mm along the path; rapids take none."""
    speed = job.conditions.feeds(program.path.feed[rows.motion])
    moving = (rows.kind != RAPID) & (speed > 0.0)
    out: Floats = np.cumsum(np.where(moving, np.diff(s, prepend=0.0) / np.where(moving, speed, 1.0) * 60.0, 0.0))
    return out


def output_of(rows: CorrectedRows, rest: Bools | None = None, apart: Bools | None = None) -> Output:
    """The rows in the form of the writer. rest, apart (N,): force a stop at the end, forbid merging."""
    return Output(
        motion=rows.motion, kind=rows.kind, end=rows.end, centre=rows.centre, angle=rows.angle, feed=rows.feed,
        joining=rows.joining, rest=rest, apart=apart, words=rows.words,
    )  # fmt: skip
