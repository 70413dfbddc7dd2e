"""Readings that the machine has not made: beam breaks and dropped telegrams go, heavy tails count less.

Both are told from the rows beside them, before anything is fitted: what a model explains badly is no outlier.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter
from scipy.stats import norm

from camcomp.diagnosis.fit.bench import Bench, thinned
from camcomp.diagnosis.model.noise import FAR_OFF, IN_A_ROW, LEAST_VALUES, MANY
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS
from camcomp.ground.datatypes import Bools, Floats

LONG = 61  # rows of the running median of several rows that are off
GROSS = 160.0  # robust deviations from the rows around it by which several rows in a row are off
FAR_MM = 5.0  # no machine is wrong by so much from one row to the next
HEAVY = 3.5  # robust deviations beyond which a reading counts less
TINY = 1e-12  # mm, rad, N: rounding of zero


def outlying(bench: Bench) -> list[Bools]:
    """Per run (n, c): cells that are no readings of the machine: beam breaks, dropped telegrams. They are listed and not fitted."""
    out = []
    for k, run in enumerate(bench.runs):
        gap = bench.off(k)
        bad = np.zeros(gap.shape, bool)
        for c, x in enumerate(gap.T):
            known = np.flatnonzero(np.isfinite(x))
            if len(known) >= LEAST_VALUES and run.run_path.ordered:
                bad[known, c] = _jumping_off(x[known])
        if run.run_path.ordered:
            bad[:, :3] |= _sprung_off(gap[:, :3])[:, None]
        bad[_as_the_tip_says(bench, k, gap, bad)] = False
        for part in (bench.parts["tip"], bench.parts["dyno"]):  # one instrument, one telegram
            bad[:, part] = np.any(bad[:, part], axis=1, keepdims=True)
        out.append(bad)
    return out


def _jumping_off(x: Floats) -> Bools:
    beside = _beside(x)
    scale = 1.4826 * float(np.median(np.abs(beside)))
    single = np.abs(beside) > FAR_OFF * max(scale, TINY)
    around = x - median_filter(x, min(LONG, len(x)), mode="mirror")
    wide = 1.4826 * float(np.median(np.abs(around)))
    # what mostly stands still is told in steps; smaller ones are those of arithmetic
    steps = np.abs(around[np.abs(around) > TINY])
    least = GROSS * max(wide, scale) if max(wide, scale) > TINY else FAR_OFF * float(np.min(steps, initial=np.inf))
    gross = np.abs(around) > least
    # a curve is its own median, and a machine may move from row to row: only what is far beyond what most rows do
    if scale <= TINY or single.mean() > MANY:
        most = float(np.quantile(np.abs(beside), 1.0 - MANY))
        single = np.abs(beside) > FAR_OFF / norm.isf(0.5 * MANY) * most if most > TINY else np.zeros_like(single)
    return np.asarray(single | (gross if gross.mean() < 2.0 * MANY else False))


def _beside(x: Floats) -> Floats:
    """Values (n,) minus their running median, which IN_A_ROW of them do not move."""
    return np.asarray(x - median_filter(x, 2 * IN_A_ROW + 1, mode="mirror"))


def _sprung_off(gap: Floats) -> Bools:
    """Rows (n,) of a tip's gap (n, 3) mm between two springs that no machine makes: a beam was broken, for how long ever.

    What goes there and back little by little is none: a workpiece may lie far askew. What never comes back is none: steps are lost.
    """
    known = np.flatnonzero(np.isfinite(gap).all(axis=1))
    x, out = gap[known], np.zeros(len(gap), bool)
    if len(known) < LEAST_VALUES:
        return out
    far = np.linalg.norm(x - np.median(x, axis=0), axis=1) > FAR_MM
    springs = np.concatenate([[False], np.linalg.norm(np.diff(x, axis=0), axis=1) > FAR_MM, [False]])
    edges = np.flatnonzero(np.diff(far, prepend=False, append=False))
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        out[known[first:end]] = springs[first] and springs[end]
    return out


def _as_the_tip_says(bench: Bench, k: int, gap: Floats, odd: Bools) -> Bools:
    """Cells (n, c) of encoders that lie far from their neighbours, odd (n, c), where the tip moved, too: two instruments do not make the same error.

    gap (n, c): measured minus nominal. What is far behind in rapids is so for few rows.
    """
    run, encoders = bench.runs[k], bench.parts["encoder"]
    out = np.zeros(gap.shape, bool)
    if run.by == "setpoint" and run.encoders is not None and odd[:, encoders].any():
        tip = np.where(odd[:, :3].any(axis=1, keepdims=True), np.nan, gap[:, :3])
        along = _gone_along(tip, gap[:, encoders], bench.row_slopes[k], odd[:, encoders])
        out[:, encoders] = odd[:, encoders] & along[:, None]
    return out


def _gone_along(tip: Floats, encoder: Floats, slopes: Floats, bad: Bools) -> Bools:
    """Rows (n,) in which the tip has gone where encoders say of which cells bad (n, m) look wrong.

    tip (n, 3), encoder (n, m): measured minus model, the tip's model led by the encoders; slopes (n, 3, m) of the tip by them.
    Only of several rows in a row: what rings beside a corner may be between them.
    """
    usual = medians(np.where(bad, np.nan, encoder))
    move = np.einsum("nij,nj->ni", slopes, np.where(bad, encoder - usual, 0.0))
    off = tip - medians(tip)
    scale = np.maximum(1.4826 * medians(np.abs(off)), TINY)
    odds = np.nansum(((off + move) ** 2 - off**2) / scale**2, axis=1)
    edges = np.flatnonzero(np.diff(bad.any(axis=1), prepend=False, append=False))
    out = np.zeros(len(tip), bool)
    for first, end in zip(edges[::2], edges[1::2], strict=True):
        out[first:end] = end - first >= IN_A_ROW and odds[first:end].sum() > 2.0 * EQUAL_LOG_ODDS
    return out


def medians(values: Floats) -> Floats:
    """Medians (c,) of the finite values of columns (n, c); 0 for an empty column."""
    known = np.isfinite(values).any(axis=0)
    out = np.zeros(values.shape[1])
    out[known] = np.nanmedian(values[:, known], axis=0)
    return out


def tails(bench: Bench) -> list[Floats]:
    """Per run (n, c) >= 1: by how much a reading counts less because it lies far from its neighbours (heavy tails)."""
    out = []
    for k, run in enumerate(bench.runs):
        gap = bench.off(k)
        weight = np.ones_like(gap)
        for c, x in enumerate(gap.T):
            known = np.flatnonzero(np.isfinite(x))
            if len(known) < LEAST_VALUES or not run.run_path.ordered:
                continue
            beside = _beside(x[known])
            scale = 1.4826 * float(np.median(np.abs(beside)))
            if scale > 0.0:
                weight[known, c] = np.maximum(np.abs(beside) / (HEAVY * scale), 1.0)
        out.append(thinned(weight, run.thin))
    return out
