"""How far the gap shrinks on runs that were not used for the fit, with an interval that respects whole runs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.ground.datatypes import Floats

_BOOTSTRAP_DRAWS = 800
_SEED = 20120624  # resampling has to give the same answer twice
_BLOCK_S = 1.0


@dataclass(frozen=True, eq=False)
class Shrinkage:
    """rms in um before and after, ratio = 1 - after / before, and its 95 % interval."""

    before: float
    after: float
    ratio: float
    low: float
    high: float


def _rms(energy: Floats, rows: Floats) -> float:
    return float(np.sqrt(energy.sum() / max(rows.sum(), 1.0)))


def shrinkage(before: Sequence[Floats], after: Sequence[Floats], times: Sequence[Floats]) -> Shrinkage:
    """before, after: squared gaps (n,) mm2 per held-out run, NaN where nothing was measured; times (n,) s.

    Four and more runs are drawn whole; fewer are drawn in blocks of one second.
    """
    blocks_before, blocks_after, counts = [], [], []
    whole = len(before) >= 4
    for b, a, t in zip(before, after, times, strict=True):
        known = np.isfinite(b) & np.isfinite(a)
        group = np.zeros(len(b), int) if whole else np.floor((t - t[0]) / _BLOCK_S).astype(int)
        for g in np.unique(group):
            rows = known & (group == g)
            blocks_before.append(float(b[rows].sum()))
            blocks_after.append(float(a[rows].sum()))
            counts.append(float(rows.sum()))
    eb, ea, n = np.array(blocks_before), np.array(blocks_after), np.array(counts)
    first, last = _rms(eb, n), _rms(ea, n)
    ratio = 1.0 - last / first if first > 0 else 0.0
    rng = np.random.default_rng(_SEED)
    pick = rng.integers(0, len(n), (_BOOTSTRAP_DRAWS, len(n)))
    with np.errstate(invalid="ignore", divide="ignore"):
        drawn = 1.0 - np.sqrt(ea[pick].sum(axis=1) / eb[pick].sum(axis=1))
    drawn = drawn[np.isfinite(drawn)]
    low, high = np.quantile(drawn, [0.025, 0.975]) if len(drawn) else (ratio, ratio)
    return Shrinkage(1e3 * first, 1e3 * last, ratio, float(min(low, ratio)), float(max(high, ratio)))
