"""Noise of every channel as an autoregression, and rows made white by it.

A block is one run: residuals (n, c) over c channels, NaN where a channel has no value. Rows next to a gap start afresh.
Source of the fit: Yule-Walker, pooled over runs after scaling each run by its own size.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.datatypes import Bools, Floats

ORDER = 3
_REGULAR = 1.6  # a step longer than this many usual steps is a gap


@dataclass(frozen=True, eq=False)
class Noise:
    """phi (c, ORDER) autoregression of every channel; sigma (runs, c) size of one row; innovation (c,) share that is new.

    The marginal standard deviation of channel c in run r is sigma[r, c], of its innovations sigma[r, c] innovation[c].
    """

    phi: Floats
    sigma: Floats
    innovation: Floats

    def rows(self, run: int, values: Floats, inflate: Floats, time: Floats, first: int = 0) -> Floats:
        """White rows (w, k) of values (n, c, k), channels from `first` on: channel by channel, missing rows left out.

        inflate (n, all channels) >= 1: by how much a row is less certain than its channel. time (n,) s.
        """
        out = []
        for j in range(first, first + values.shape[1]):
            present = np.isfinite(inflate[:, j])
            if not present.any() or not np.isfinite(self.sigma[run, j]):
                continue
            scaled = values[present, j - first] / (self.sigma[run, j] * inflate[present, j])[:, None]
            out.append(self._filter(scaled, starts(time, present), j))
        return np.concatenate(out) if out else np.zeros((0, values.shape[2]))

    def _filter(self, x: Floats, fresh: Bools, channel: int) -> Floats:
        phi, share = self.phi[channel], self.innovation[channel]
        white = x.copy()
        for lag in range(1, ORDER + 1):
            white[lag:] -= phi[lag - 1] * x[:-lag]
        white /= share
        # the first rows after a gap have no past: their own size is all there is to scale them by
        for lag in range(ORDER):
            at = np.flatnonzero(fresh) + lag
            at = at[at < len(x)]
            white[at] = x[at]
        return white


def starts(time: Floats, present: Bools) -> Bools:
    """Of the rows present: which begin after a gap in time (n,) or in the channel."""
    index = np.flatnonzero(present)
    if len(index) == 0:
        return np.zeros(0, bool)
    step = np.diff(time[index])
    usual = float(np.median(step)) if len(step) else 1.0
    gap = (step > _REGULAR * usual) | (step < 0) if usual > 0 else np.ones(len(step), bool)
    return np.concatenate([[True], gap])


def fit_noise(
    residuals: Sequence[Floats], inflate: Sequence[Floats], times: Sequence[Floats], ordered: Sequence[bool]
) -> Noise:
    """Noise of what no model explains: residuals, inflate (n, c) and times (n,) per run. Robust against 2 % outliers."""
    channels = residuals[0].shape[1]
    sigma = np.full((len(residuals), channels), np.nan)
    phi, innovation = np.zeros((channels, ORDER)), np.ones(channels)
    for j in range(channels):
        covariance, weight = np.zeros(ORDER + 1), 0.0
        for r, (residual, grow) in enumerate(zip(residuals, inflate, strict=True)):
            present = np.isfinite(residual[:, j]) & np.isfinite(grow[:, j])
            if present.sum() < 2:
                continue
            x = residual[present, j] / grow[present, j]
            size = robust_size(x)
            sigma[r, j] = max(size, 1e-12)
            if not ordered[r] or present.sum() < 40:
                continue
            x = np.clip(x / sigma[r, j], -4.0, 4.0)
            fresh = starts(times[r], present)
            group = np.cumsum(fresh)
            for lag in range(ORDER + 1):
                same = group[lag:] == group[: len(group) - lag]
                covariance[lag] += float((x[lag:] * x[: len(x) - lag])[same].sum())
            weight += len(x)
        if weight > 0 and covariance[0] > 0:
            phi[j], innovation[j] = _yule_walker(covariance / covariance[0])
    known = np.isfinite(sigma)
    for j in range(channels):
        if known[:, j].any():  # a run too short to tell borrows from the others
            sigma[known[:, j], j] = np.maximum(sigma[known[:, j], j], 0.3 * np.median(sigma[known[:, j], j]))
    return Noise(phi, sigma, innovation)


def robust_size(x: Floats) -> float:
    """Standard deviation of x (n,) about zero, from the middle of its absolute values where tails are heavy."""
    rms = float(np.sqrt(np.mean(x**2)))
    middle = float(np.median(np.abs(x)) * 1.4826)
    return rms if rms < 1.5 * middle or middle == 0.0 else 1.5 * middle


def _yule_walker(correlation: Floats) -> tuple[Floats, float]:
    toeplitz = correlation[np.abs(np.subtract.outer(np.arange(ORDER), np.arange(ORDER)))] + 1e-3 * np.eye(ORDER)
    phi = np.linalg.solve(toeplitz, correlation[1:])
    left = float(1.0 - phi @ correlation[1:])
    return np.asarray(phi, float), float(np.sqrt(max(left, 0.02)))


def effective_rows(noise: Noise, channel: int, n: int) -> float:
    """How many independent rows n correlated ones are worth for a mean."""
    gain = 1.0 - noise.phi[channel].sum()
    return n * float(np.clip(gain**2 / noise.innovation[channel] ** 2, 1e-3, 1.0))
