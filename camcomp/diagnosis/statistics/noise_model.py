"""Noise of every channel as white noise plus a slow part, and rows made white by it.

A block is one run: residuals (n, c) over c channels, NaN where a channel has no value. Rows next to a gap start afresh.
The slow part is a first-order autoregression, so that ten parameters cannot follow what two explain; whitening is the
exact innovations form (Kalman 1960). Source of the fit: autocorrelations, pooled over runs after scaling each run by its
own size.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.ground.datatypes import Bools, Floats
from camcomp.ground.machine_code import kept

LAGS = 30
_MEMORIES = np.array([-0.5, -0.2, 0.2, 0.4, 0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.93, 0.95, 0.97, 0.98, 0.99])
_MOST_SLOW = 0.98  # share of the slow part: some of every reading is new
_SURE = 8.0  # sum of squared autocorrelations over their variance that a slow part has to explain
_REGULAR = 1.6  # a step longer than this many usual steps is a gap


@dataclass(frozen=True, eq=False)
class Noise:
    """Per run and channel (runs, c): sigma size of one row, slow share of the variance that remembers, memory from row to row."""

    sigma: Floats
    slow: Floats
    memory: Floats

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
            slow, memory = float(self.slow[run, j]), float(self.memory[run, j])
            if slow > 0.0:
                scaled = _innovations(scaled, starts(time, present), slow, memory)
            out.append(scaled)
        return np.concatenate(out) if out else np.zeros((0, values.shape[2]))

    def rows_of(self, run: int, value: Floats, inflate: Floats) -> Floats:
        """Value (n,) of every white row (w,) of all channels, in the order of `rows`."""
        out = [
            value[np.isfinite(inflate[:, j])]
            for j in range(inflate.shape[1])
            if np.isfinite(inflate[:, j]).any() and np.isfinite(self.sigma[run, j])
        ]
        return np.concatenate(out) if out else np.zeros(0)


@kept
def _innovations(x, fresh, slow, memory):  # type: ignore[no-untyped-def]  # pragma: no cover
    n, k = x.shape
    out = np.empty((n, k))
    expected = np.zeros(k)
    unsure = slow
    for t in range(n):
        if fresh[t]:
            expected[:] = 0.0
            unsure = slow
        whole = unsure + 1.0 - slow
        gain, scale = unsure / whole, 1.0 / np.sqrt(whole)
        for j in range(k):
            surprise = x[t, j] - expected[j]
            out[t, j] = surprise * scale
            expected[j] = memory * (expected[j] + gain * surprise)
        unsure = memory * memory * unsure * (1.0 - gain) + slow * (1.0 - memory * memory)
    return out


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
    residuals: Sequence[Floats], inflate: Sequence[Floats], times: Sequence[Floats], ordered: Sequence[bool],
    kinds: Sequence[slice] = (),
) -> Noise:  # fmt: skip
    """Noise of what no model explains: residuals, inflate (n, c) and times (n,) per run. Robust against 2 % outliers.

    kinds: channels that one sensor measures.
    """
    channels = residuals[0].shape[1]
    sigma = np.full((len(residuals), channels), np.nan)
    slow, memory = np.zeros_like(sigma), np.zeros_like(sigma)
    covariance, rows = np.zeros((len(residuals), channels, LAGS + 1)), np.zeros((len(residuals), channels))
    for j in range(channels):
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
            group = np.cumsum(starts(times[r], present))
            for lag in range(LAGS + 1):
                same = group[lag:] == group[: len(group) - lag]
                covariance[r, j, lag] = float((x[lag:] * x[: len(x) - lag])[same].sum())
            rows[r, j] = len(x)
    for r, j in zip(*np.nonzero(rows > 0), strict=True):
        # one run of one channel says little: what its sensor does in its other axes and the channel in other runs helps
        own = np.zeros(channels)
        own[next((part for part in kinds if part.start <= j < part.stop), slice(j, j + 1))] = 0.5
        own[j] = 1.0
        others = covariance[:, j].sum(axis=0) * (0.5 * rows[r, j] / rows[:, j].sum())
        mine = own @ covariance[r] + others
        slow[r, j], memory[r, j] = _slow_part(mine[1:] / mine[0], float(own @ rows[r]) + 0.5 * rows[r, j])
    known = np.isfinite(sigma)
    for j in range(channels):
        if known[:, j].any():  # a run too short to tell borrows from the others
            sigma[known[:, j], j] = np.maximum(sigma[known[:, j], j], 0.3 * np.median(sigma[known[:, j], j]))
    return Noise(sigma, slow, memory)


def robust_size(x: Floats) -> float:
    """Standard deviation of x (n,) about zero, from the middle of its absolute values where tails are heavy."""
    rms = float(np.sqrt(np.mean(x**2)))
    middle = float(np.median(np.abs(x)) * 1.4826)
    return rms if rms < 1.5 * middle or middle == 0.0 else 1.5 * middle


def _slow_part(correlation: Floats, rows: float) -> tuple[float, float]:
    """Share and memory of the slow part from autocorrelations (LAGS,) at lags 1, 2, ... of that many rows."""
    lag = np.arange(1, LAGS + 1)
    best = (0.0, 0.0, 0.0)
    for memory in _MEMORIES:
        shape = memory**lag
        share = float(np.clip(correlation @ shape / (shape @ shape), 0.0, _MOST_SLOW))
        gain = float(np.sum(correlation**2) - np.sum((correlation - share * shape) ** 2))
        if gain > best[0]:
            best = (gain, share, float(memory))
    return (best[1], best[2]) if rows * best[0] > _SURE else (0.0, 0.0)


def effective_rows(noise: Noise, channel: int, n: int) -> float:
    """How many independent rows n correlated ones are worth for a mean."""
    slow, memory = noise.slow[:, channel], np.maximum(noise.memory[:, channel], 0.0)
    return n / float(np.mean(1.0 + 2.0 * slow * memory / (1.0 - memory)))
