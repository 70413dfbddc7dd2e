"""Noise of every channel as white noise plus a slow part, and rows made white by it.

A block is one run: residuals (n, c) over c channels, NaN where a channel has no value. Rows next to a gap start afresh.
The slow part is a first-order autoregression; whitening is the exact innovations form (Kalman 1960).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.ground.compiled import kept
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.model.seams import missing_rows

BLOCK = 8  # rows that are averaged, or whose noise shares a sign


@dataclass(frozen=True, eq=False)
class Noise:
    """Per run and channel (runs, c): sigma size of one row, slow share of the variance that remembers, memory from row to row.

    Per run: inflate (n, c) >= 1, by how much a row is less certain than its channel, NaN where it has no value; time (n,) s.
    """

    sigma: Floats
    slow: Floats
    memory: Floats
    inflate: Sequence[Floats]
    time: Sequence[Floats]

    @cached_property
    def _channels(self) -> list[dict[int, tuple[Ints, Floats, Bools]]]:
        """Per run, of every channel that has some: its rows (w,), their deviation (w,), and which of them start afresh."""
        out = []
        for inflate, time, sigma in zip(self.inflate, self.time, self.sigma, strict=True):
            present = np.isfinite(inflate) & np.isfinite(sigma)
            found = {j: np.flatnonzero(present[:, j]) for j in np.flatnonzero(present.any(axis=0)).tolist()}
            out.append({j: (rows, sigma[j] * inflate[rows, j], _starts(time[rows])) for j, rows in found.items()})
        return out

    def rows(self, run: int, values: Floats) -> Floats:
        """White rows (w, k) of values (n, c, k): channel by channel, missing rows left out."""
        channels = ByChannel.of(values[:, j] for j in range(values.shape[1]))
        return np.asarray(self.by_channel(run, channels)[:, np.arange(values.shape[2])])

    def by_channel(self, run: int, values: ByChannel) -> ByChannel:
        """The same of values whose channels, n rows each, lie one behind the other."""
        parts = []
        for j, (rows, scale, fresh) in self._channels[run].items():
            on, x = values.parts[j]
            white = np.empty((len(rows), len(on)))
            _innovations(x, rows, scale, fresh, self.slow[run, j], self.memory[run, j], white)
            parts.append((on, white))
        return ByChannel(values.width, tuple(parts))


@kept
def _innovations(x, rows, scale, fresh, slow, memory, out):  # type: ignore[no-untyped-def]  # pragma: no cover
    n, k = out.shape
    expected = np.zeros(k)
    unsure = slow
    for t in range(n):
        if fresh[t]:
            expected[:] = 0.0
            unsure = slow
        whole = unsure + 1.0 - slow
        gain, root, row, size = unsure / whole, 1.0 / np.sqrt(whole), rows[t], scale[t]
        for j in range(k):
            surprise = x[row, j] / size - expected[j]
            out[t, j] = surprise * root
            expected[j] = memory * (expected[j] + gain * surprise)
        unsure = memory * memory * unsure * (1.0 - gain) + slow * (1.0 - memory * memory)


def _starts(time: Floats) -> Bools:
    """Which rows of a channel at times (n,) begin after a gap."""
    return np.append(True, missing_rows(time) | (np.diff(time) <= 0.0))


def effective_rows(noise: Noise, channel: int, n: int) -> float:
    """How many independent rows n correlated ones are worth for a mean."""
    slow, memory = noise.slow[:, channel], np.maximum(noise.memory[:, channel], 0.0)
    return n / float(np.mean(1.0 + 2.0 * slow * memory / (1.0 - memory)))


def weighted_median(values: Floats, weights: Floats) -> float:
    """The value of (n,) with half of the weights (n,) on either side; 0 of none."""
    if not len(values):
        return 0.0
    order = np.argsort(values)
    done = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(done, 0.5 * done[-1])])
