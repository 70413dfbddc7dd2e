"""Bands of a program that was corrected as a whole."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from camcomp.compensation.bands.outcome import Bands, BandTotals
from camcomp.compensation.program.uncertainty import Uncertainty
from camcomp.ground.datatypes import Floats
from camcomp.model.cutting.track import Track
from camcomp.model.job import Job

if TYPE_CHECKING:
    from camcomp.compensation.program.corrected_rows import CorrectedRows
    from camcomp.compensation.program.judged_points import JudgedPoints, Seen


def bands_of(
    job: Job,
    track: Track,
    *,
    rows: CorrectedRows,
    points: JudgedPoints,
    told: Floats,
    before: Seen,
    after: Seen,
    share: Floats | None = None,
) -> Bands | None:
    """Bands of a corrected program. told (k, 3) mm: commanded points; share (N,): taken part of the correction."""
    if not job.config.uncertain:
        return None
    uncertainty = Uncertainty(job, track)
    if job.causes:
        at = np.arange(len(points.row))
    else:
        at = np.flatnonzero(points.end)
    free = (rows.joining & (rows.w > 0.0))[points.row]
    moves = uncertainty.moves(
        points.piece[at], points.w[at], commanded=told[at], travel=points.travel.take(at), free=free[at],
        base=(after.error + points.target)[at], before=points.before,
    )  # fmt: skip
    ends = moves.take(np.flatnonzero(points.end[at]))
    counted = np.flatnonzero(points.judged)
    totals = BandTotals(uncertainty.inputs)
    taken = np.ones(len(rows.w)) if share is None else share
    totals.add(after.error[counted], ends.take(points.row[counted]), taken[points.row[counted]])
    return Bands(
        before=before.error[points.end], after=after.error[points.end], moves=ends, share=taken, known=rows.corrected,
        totals=totals,
    )  # fmt: skip
