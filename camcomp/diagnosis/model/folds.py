"""Excess residual on held-out folds: whether groups that were not fitted keep more than their noise.

A fold is a group, or a region of positions where there is one group. left (n, c): residual of the fold by the fit to the
others; near: by the fit to all. E[left near] = noise squared, whatever the fit to the others leaves open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from camcomp.diagnosis.model.evidence import Background, LinearModel, Members
from camcomp.diagnosis.model.group import split_regions
from camcomp.diagnosis.model.noise import AT_FLOOR
from camcomp.diagnosis.statistics.places import FALSE
from camcomp.ground.datatypes import Floats

ABOVE = 1.25  # of the floor's square: instruments know themselves to an eighth
REGIONS = 16  # of positions or time, between which squares are compared


@dataclass(frozen=True)
class Excess:
    """Mean square of residuals in units of the noise, and its standard error."""

    mean: float
    error: float

    @property
    def above(self) -> bool:
        """Whether the residual surely exceeds the noise."""
        return self.mean - float(norm.isf(FALSE)) * self.error > ABOVE

    @property
    def at_floor(self) -> bool:
        """Whether the residual is likely to be noise."""
        return self.mean + float(norm.isf(FALSE)) * self.error < AT_FLOOR

    @property
    def log10_chance(self) -> float:
        """Logarithm of the chance of a mean square like this where the residual is noise."""
        return float(norm.logsf((self.mean - ABOVE) / max(self.error, 1e-12)) / np.log(10.0))


def folds_of(model: LinearModel) -> list[tuple[int, tuple[int, ...]]]:
    """Groups that are judged, each with those it is predicted from: held-out ones by the fitted, else each by the others."""
    own = model.own
    if len(own) < len(model.groups):
        return [(g, own) for g in range(len(model.groups)) if g not in own]
    return [(g, tuple(i for i in own if i != g)) for g in own]


def excess_of(
    model: LinearModel, background: Background, members: Members, folds: Sequence[tuple[int, tuple[int, ...]]],
    freedom: float,
) -> Excess:  # fmt: skip
    """Mean square against the noise of folds, with a set and its background fitted to their other groups.

    Its standard error is that between regions and of the noise itself (freedom).
    """
    slab = model.reduced(background).slab(members)
    total, count = [], []
    for g, others in folds:
        group, D = model.groups[g], model.layout.design(model.groups[g])
        left, near = (group.y - D @ model.posterior(background, slab, by).mean for by in (others, (*others, g)))
        alone = all(model.groups[i].label != group.label for i in others)
        values = np.isfinite(group.y).sum(axis=1)
        known = int(values.sum())
        squares = (
            np.nan_to_num(left * near / group.sd**2).sum(axis=1) * known / max(known - alone * group.N.shape[2], 1)
        )
        at = group.positions("posture" if group.position is not None else "time")
        region = split_regions(at, min(REGIONS, max(len(squares) // 4, 2)))
        for i in np.unique(region):
            total.append(float(squares[region == i].sum()))
            count.append(float(values[region == i].sum()))
    s, n = np.array(total), np.array(count)
    mean = float(s.sum() / n.sum())
    between = float(np.sqrt(((s - mean * n) ** 2).sum() * len(n) / max(len(n) - 1, 1)) / n.sum())
    even = mean * float(np.sqrt(2.0 / n.sum()))
    return Excess(mean, float(np.hypot(max(between, even), mean * np.sqrt(2.0 / freedom))))


def without_nuisances(left: Floats, N: Floats) -> Floats:
    """Residual (n, c) after the best nuisances of N (n, c, p); missing values stay NaN."""
    seen = np.isfinite(left)
    A = N[seen]
    return left - N @ np.linalg.lstsq(A, left[seen], rcond=1e-10)[0]
